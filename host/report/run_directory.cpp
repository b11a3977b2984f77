// Run directories, staged folders, the lock that both hold.
#include "host/report/run_directory.hpp"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
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

constexpr const char* kLockName = ".lock";

[[noreturn]] void fail_with_reason(const std::string& what, const fs::path& where, int reason) {
  throw Error(ErrorKind::Failed, what + ": " + std::strerror(reason), where.string());
}

void move_path(const fs::path& from, const fs::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) fail_with_reason("cannot be moved to " + to.string(), from, errno);
}

void remove_tree(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (error) throw Error(ErrorKind::Failed, "cannot be removed: " + error.message(), path.string());
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

/// Same results as the config that the directory was made with? Keys that stand aside may differ.
void check_same_config(const fs::path& file, const Config& config) {
  std::string hash;
  try {
    hash = config_hash(parse_config(read_file(file), file.string(), config.schema()));
  } catch (const Error& error) {
    throw usage_error("this run was made with a config that this program does not read: " + std::string(error.what()),
                      file.string(), {}, "another output folder, or a restart of the run");
  }
  if (hash != config_hash(config))
    throw usage_error("this folder belongs to another config", file.string(), hash, config_hash(config));
}

}  // namespace

FileLock::FileLock(const fs::path& path) : path_(path) {
  for (;;) {
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0) throw usage_error(std::string("cannot be locked: ") + std::strerror(errno), path.string());
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
      const int reason = errno;
      ::close(file_);
      if (reason != EWOULDBLOCK) fail_with_reason("cannot be locked", path, reason);
      throw usage_error("another process is at work here", path.string());
    }
    // The one before us may have deleted the file between our open and our lock: then we hold nothing that anyone sees.
    struct stat mine {
    }, there{};
    if (::fstat(file_, &mine) == 0 && ::stat(path.c_str(), &there) == 0 && mine.st_ino == there.st_ino) return;
    ::close(file_);
  }
}

FileLock::~FileLock() {
  ::unlink(path_.c_str());
  ::close(file_);
}

fs::path RunDirectory::path_of(const fs::path& root, const std::string& experiment, const std::string& variant,
                               const Config& config, std::uint64_t seed) {
  return root / checked_name(experiment, "the experiment's name") /
         fmt::format("{}-{}-s{}", checked_name(variant, "the variant's name"), config_hash(config), seed);
}

RunDirectory::RunDirectory(const fs::path& root, const std::string& experiment, const std::string& variant,
                           const Config& config, std::uint64_t seed, bool restart)
    : path_(path_of(root, experiment, variant, config, seed)) {
  make_directories(path_);
  lock_.emplace(path_ / kLockName);
  if (restart)
    for (const auto& entry : fs::directory_iterator(path_))
      if (entry.path().filename() != kLockName) remove_tree(entry.path());
  const fs::path resolved = path_ / "config.resolved.toml";
  if (fs::exists(resolved)) check_same_config(resolved, config);
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

void RunDirectory::fail(const std::string& message) const {
  write_file(path_ / "FAILED", utc_now() + " " + message + "\n");
}

StagedFolder::StagedFolder(fs::path target, std::string marker) : marker_(std::move(marker)) {
  // A link is followed, so that the folder behind it is replaced and the link stays.
  target_ = fs::weakly_canonical(fs::absolute(target));
  if (!target_.has_filename()) target_ = target_.parent_path();
  const fs::path parent = target_.parent_path();
  if (target_ == parent) throw usage_error("cannot be an output folder", target.string());
  make_directories(parent);
  const std::string name = "." + target_.filename().string();
  lock_.emplace(parent / (name + ".lock"));
  staging_ = parent / (name + ".partial");
  const fs::path old = parent / (name + ".old");
  // A process that died in the middle of a replacement without RENAME_EXCHANGE left the old folder under another name.
  if (fs::exists(old) && !fs::exists(target_)) move_path(old, target_);
  remove_tree(old);
  check_target();
  remove_tree(staging_);
  make_directories(staging_);
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(staging_, ignored);
}

void StagedFolder::check_target() const {
  std::error_code error;
  const auto status = fs::status(target_, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) throw usage_error("a file stands where a folder should be", target_.string());
  if (!fs::is_empty(target_) && !fs::exists(target_ / marker_))
    throw usage_error("this folder holds other things and is not replaced", target_.string(), {},
                      "a new or empty folder, or one that holds " + marker_);
}

void StagedFolder::commit() {
  check_target();
  if (!fs::exists(target_)) {
    move_path(staging_, target_);
  } else if (::renameat2(AT_FDCWD, staging_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0) {
    remove_tree(staging_);  // now the old folder
  } else {
    const fs::path old = target_.parent_path() / ("." + target_.filename().string() + ".old");
    move_path(target_, old);
    move_path(staging_, target_);
    remove_tree(old);
  }
  committed_ = true;
}

}  // namespace clerestory
