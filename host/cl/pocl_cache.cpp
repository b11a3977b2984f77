#include "host/cl/pocl_cache.hpp"

#include <elf.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <system_error>

namespace clerestory {
namespace {

namespace fs = std::filesystem;

template <class T>
std::optional<T> read_at(std::ifstream& file, std::uint64_t at) {
  T value;
  file.seekg(static_cast<std::streamoff>(at));
  if (!file.read(reinterpret_cast<char*>(&value), sizeof value)) return {};
  return value;
}

/// A shared object whose table of sections, which linkers write last, is there and says so.
bool whole_object(std::ifstream& file, std::uint64_t) {
  const auto header = read_at<Elf64_Ehdr>(file, 0);
  if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0) return false;
  const auto section = [&](std::uint64_t i) {
    return read_at<Elf64_Shdr>(file, header->e_shoff + i * header->e_shentsize);
  };
  const auto names = section(header->e_shstrndx);
  return names && names->sh_type == SHT_STRTAB && header->e_shnum > 0 && section(header->e_shnum - 1u);
}

/// LLVM's bitcode: blocks that follow each other to the end of the file (LLVM Bitcode File Format, "Blocks"). Each
/// begins with a word of its kind, whose last two bits are 1, and its length in words.
bool whole_bitcode(std::ifstream& file, std::uint64_t bytes) {
  if (read_at<std::uint32_t>(file, 0) != 0xdec04342) return false;
  std::uint64_t at = 4;
  while (at < bytes) {
    const auto kind = read_at<std::uint32_t>(file, at), words = read_at<std::uint32_t>(file, at + 4);
    if (!kind || !words || (*kind & 3) != 1) return false;
    at += 8 + 4 * std::uint64_t{*words};
  }
  return at == bytes && bytes > 4;
}

/// Entries get their names when they are whole; until then they are PoCL's temporaries, which a process that is at work
/// needs. Only a power cut or a full disk leaves an entry that is not whole.
bool broken(const fs::directory_entry& entry) {
  if (entry.path().filename().string().starts_with("tempfile")) return false;
  const fs::path ending = entry.path().extension();
  if (ending != ".so" && ending != ".bc") return false;
  std::error_code error;
  const std::uint64_t bytes = entry.file_size(error);
  std::ifstream file(entry.path(), std::ios::binary);
  if (error || !file) return false;  // not ours to judge: PoCL cannot read it either
  return !(ending == ".so" ? whole_object(file, bytes) : whole_bitcode(file, bytes));
}

}  // namespace

PoclCacheFolder pocl_cache_folder() {
  if (const char* own = std::getenv("POCL_CACHE_DIR")) return {own, "POCL_CACHE_DIR"};
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0')
    return {fs::path(xdg) / "pocl/kcache", "XDG_CACHE_HOME"};
  if (const char* home = std::getenv("HOME")) return {std::string(home) + "/.cache/pocl/kcache", "HOME"};
  return {"/tmp/pocl/kcache", ""};
}

std::string describe(const PoclCacheFolder& folder) {
  return folder.variable.empty() ? folder.path.string() : folder.path.string() + ", from " + folder.variable;
}

std::string pocl_cache_fault() {
  const PoclCacheFolder folder = pocl_cache_folder();
  if (folder.path.empty()) return folder.variable + " is empty; unset it, or name a folder";
  const auto fault = [&](const std::string& why) {
    return fmt::format("the cache of PoCL ({}) {}; name a folder that can be written in POCL_CACHE_DIR",
                       describe(folder), why);
  };
  std::error_code error;
  fs::create_directories(folder.path, error);
  if (error) return fault("cannot be made: " + error.message());
  if (::access(folder.path.c_str(), R_OK | W_OK | X_OK) != 0)
    return fault("cannot be written: " + std::generic_category().message(errno));
  return {};
}

int drop_broken_pocl_entries() {
  int dropped = 0;
  constexpr auto readable = fs::directory_options::skip_permission_denied;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(pocl_cache_folder().path, readable, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (!entry->is_regular_file(ignored) || !broken(*entry)) continue;
    spdlog::debug("{} is not whole and is removed", entry->path().string());
    if (fs::remove(entry->path(), ignored)) ++dropped;
  }
  return dropped;
}

}  // namespace clerestory
