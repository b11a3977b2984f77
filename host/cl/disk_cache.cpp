#include "host/cl/disk_cache.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

namespace clerestory {
namespace {

constexpr std::string_view magic = "clerestory cache 1\n";

std::filesystem::path default_folder() {
  // The base directory specification asks to ignore a relative path.
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/')
    return std::filesystem::path(cache) / "clerestory";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/')
    return std::filesystem::path(home) / ".cache" / "clerestory";
  return {};
}

/// What comes before the content: everything that says whether the file is whole and the one looked for.
std::string header(std::string_view key, std::string_view content) {
  return fmt::format("{}{} {} {:016x}\n{}\n", magic, key.size(), content.size(), hash_text(content), key);
}

}  // namespace

std::uint64_t hash_text(std::string_view text, std::uint64_t seed) {
  for (const char c : text) seed = (seed ^ static_cast<unsigned char>(c)) * 1099511628211ull;
  return seed;
}

DiskCache::DiskCache(std::filesystem::path folder) : folder_(folder.empty() ? default_folder() : std::move(folder)) {}

std::filesystem::path DiskCache::path(std::string_view kind, std::string_view key) const {
  if (folder_.empty()) return {};
  return folder_ / fmt::format("{}-{:016x}.bin", kind, hash_text(key));
}

std::optional<std::string> DiskCache::load(std::string_view kind, std::string_view key) const {
  std::error_code error;
  if (folder_.empty() || !std::filesystem::is_regular_file(path(kind, key), error)) return {};
  std::ifstream stream(path(kind, key), std::ios::binary);
  const std::string file{std::istreambuf_iterator<char>(stream), {}};
  // The header says how long the content is, but what follows the key is taken as it is and has to give the same
  // header.
  const std::size_t first = file.find('\n', magic.size());
  if (!file.starts_with(magic) || first == std::string::npos) return {};
  const std::size_t start = first + 1 + key.size() + 1;
  if (file.size() < start) return {};
  const std::string_view content = std::string_view(file).substr(start);
  if (std::string_view(file).substr(0, start) != header(key, content)) return {};
  return std::string(content);
}

void DiskCache::store(std::string_view kind, std::string_view key, std::string_view content) const {
  if (folder_.empty()) return;
  const std::filesystem::path target = path(kind, key);
  const std::filesystem::path temporary = fmt::format("{}.{}.new", target.string(), ::getpid());
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (std::filesystem::is_directory(target, error)) std::filesystem::remove(target, error);  // if it is empty
  std::ofstream stream(temporary, std::ios::binary);
  stream << header(key, content) << content;
  stream.close();
  error.clear();
  if (stream) std::filesystem::rename(temporary, target, error);
  if (!stream || error) {
    spdlog::debug("nothing kept in {}: it cannot be written", folder_.string());
    std::filesystem::remove(temporary, error);
  }
}

}  // namespace clerestory
