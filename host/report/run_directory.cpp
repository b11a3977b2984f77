#include "host/report/run_directory.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail_with_reason(const std::string& what, const fs::path& where, int reason) {
  throw Error(ErrorKind::Failed, what + ": " + std::strerror(reason), where.string());
}

std::string checked_name(const std::string& name, const char* what) {
  if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos)
    throw usage_error(std::string(what) + " is not fit for a folder's name", {}, "'" + name + "'");
  return name;
}

std::vector<Checkpoint> checkpoints_in(const fs::path& folder) {
  static const std::string prefix = "step-", suffix = ".safetensors";
  std::vector<Checkpoint> found;
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || !name.ends_with(suffix)) continue;
    const char *first = name.data() + prefix.size(), *last = name.data() + name.size() - suffix.size();
    std::int64_t step = 0;
    const auto [end, error] = std::from_chars(first, last, step);
    if (error == std::errc() && end == last && first != last) found.push_back({step, entry.path()});
  }
  std::ranges::sort(found, {}, &Checkpoint::step);
  return found;
}

constexpr std::uint64_t kMostConfig = std::uint64_t{16} << 20;  // bytes

/// Same results as the config that the directory was made with? Keys that stand aside may differ.
void check_same_config(const fs::path& file, const Config& config) {
  std::string hash;
  try {
    hash = config_hash(parse_config(read_file(file, kMostConfig, true), file.string(), config.schema()));
  } catch (const Error& error) {
    throw usage_error("this run was made with a config that this program does not read: " + std::string(error.what()),
                      file.string(), {}, "another output folder, or this one removed");
  }
  if (hash != config_hash(config))
    throw usage_error("this folder belongs to another config", file.string(), hash, config_hash(config));
}

}  // namespace

fs::path RunDirectory::path_of(const fs::path& root, const std::string& experiment, const std::string& variant,
                               const Config& config, std::uint64_t seed) {
  return root / checked_name(experiment, "the experiment's name") /
         fmt::format("{}-{}-s{}", checked_name(variant, "the variant's name"), config_hash(config), seed);
}

RunDirectory::RunDirectory(const fs::path& root, const std::string& experiment, const std::string& variant,
                           const Config& config, std::uint64_t seed, bool restart)
    : path_(path_of(root, experiment, variant, config, seed)) {
  made_.emplace(path_);
  lock_.emplace(lock_of(path_), LockKind::Write, path_);
  if (restart)
    for (const auto& entry : fs::directory_iterator(path_))
      if (entry.path() != lock_of(path_)) remove_tree(entry.path());
  const fs::path resolved = path_ / "config.resolved.toml";
  fresh_ = !fs::exists(resolved);
  if (!fresh_) check_same_config(resolved, config);
  make_directories(path_ / "checkpoints");
  make_directories(path_ / "artifacts");
  if (!done()) write_file(resolved, config_toml(config));
}

bool RunDirectory::done() const { return fs::exists(path_ / "DONE"); }

fs::path RunDirectory::checkpoint_path(std::int64_t step) const {
  return path_ / "checkpoints" / fmt::format("step-{:08d}.safetensors", step);
}

std::optional<Checkpoint> RunDirectory::latest_checkpoint() const {
  const auto all = checkpoints_in(path_ / "checkpoints");
  return all.empty() ? std::nullopt : std::optional(all.back());
}

void RunDirectory::prune_checkpoints(int keep) const {
  const auto all = checkpoints_in(path_ / "checkpoints");
  const std::size_t kept = static_cast<std::size_t>(std::max(keep, 1));
  for (std::size_t i = 0; i + kept < all.size(); ++i) remove_tree(all[i].path);
}

void RunDirectory::resume_at(std::int64_t step) const {
  remove_tree(path_ / "FAILED");
  for (const Checkpoint& checkpoint : checkpoints_in(path_ / "checkpoints"))
    if (checkpoint.step > step) remove_tree(checkpoint.path);
  cut_metrics(metrics_path(), step);
}

void RunDirectory::log(const std::string& line) const {
  say(line);
  const std::string text = utc_now() + " " + line + "\n";
  const fs::path path = path_ / "log.txt";
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file < 0) fail_with_reason("cannot be written", path, errno);
  const bool whole = ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int reason = errno;
  ::close(file);
  if (!whole) fail_with_reason("cannot be written", path, reason);
}

void RunDirectory::finish() const {
  remove_tree(path_ / "FAILED");
  write_file(path_ / "DONE", utc_now() + "\n");
}

void RunDirectory::fail(const Error& error, bool results) const {
  if (error.kind() == ErrorKind::Interrupted) return;
  if (error.kind() == ErrorKind::Usage && fresh_ && !results)
    remove_tree(path_);
  else
    write_file(path_ / "FAILED", utc_now() + " " + error.what() + "\n");
}

}  // namespace clerestory
