// flock() on files that come and go.
#include "host/report/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <regex>
#include <thread>
#include <utility>

#include "host/io/files.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace fs = std::filesystem;
namespace {

/// Whether the descriptor is of the file that now has this name.
bool is_file_at(int file, const fs::path& path) {
  struct stat mine {
  }, there{};
  return ::fstat(file, &mine) == 0 && ::stat(path.c_str(), &there) == 0 && mine.st_ino == there.st_ino;
}

/// Nobody who may write there can be kept out by one who may not.
bool may_not_write(int reason) { return reason == EACCES || reason == EPERM || reason == EROFS; }

constexpr int kLeavingTries = 20;            // a reader that leaves holds the file alone for a moment
constexpr std::size_t kLongestHolder = 300;  // bytes; a host's name has 255 at most

/// This process, as others are told of it.
std::string this_holder() {
  char host[256] = "";
  ::gethostname(host, sizeof host - 1);
  return fmt::format("pid {} on {}\n", ::getpid(), host);
}

/// The writer that holds a file; empty where readers do, who leave no name.
std::string holder_of(int file) {
  if (::flock(file, LOCK_SH | LOCK_NB) == 0) return {};
  std::string text(kLongestHolder, '\0');
  const ssize_t got = ::pread(file, text.data(), text.size(), 0);
  return text.substr(0, std::min(text.find('\n'), static_cast<std::size_t>(std::max<ssize_t>(got, 0))));
}

}  // namespace

FileLock::FileLock(const fs::path& path, LockKind kind, const fs::path& guarded) : path_(path) {
  take(kind, guarded.empty() ? path : guarded);
}

void FileLock::take(LockKind kind, const fs::path& guarded) {
  // A writer leaves its name; and NFS locks a file for one alone only where it is open for writing.
  const int access = kind == LockKind::Write ? O_RDWR : O_RDONLY;
  for (int tries = 1;; ++tries) {
    file_ = ::open(path_.c_str(), access | O_CREAT | O_CLOEXEC, 0666);
    if (file_ < 0 && kind == LockKind::Read && may_not_write(errno)) return;
    if (file_ < 0) throw usage_error(std::string("cannot be locked: ") + std::strerror(errno), path_.string());
    if (::flock(file_, (kind == LockKind::Read ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0) {
      const int reason = errno;
      const std::string holder = reason == EWOULDBLOCK ? holder_of(file_) : "";
      ::close(file_);
      if (reason == EWOULDBLOCK && kind == LockKind::Read && tries < kLeavingTries) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      if (reason != EWOULDBLOCK)
        throw Error(ErrorKind::Failed, std::string("cannot be locked: ") + std::strerror(reason), path_.string());
      throw AtWork(ErrorKind::Usage, "another process is at work here", guarded.string(), holder);
    }
    // The one before us may have deleted the file between our open and our lock: then we hold nothing that anyone sees.
    if (is_file_at(file_, path_)) break;
    ::close(file_);
  }
  if (kind == LockKind::Write) write_holder();
}

void FileLock::write_holder() const {
  const std::string name = this_holder();
  if (::ftruncate(file_, 0) == 0 && ::pwrite(file_, name.data(), name.size(), 0) == static_cast<ssize_t>(name.size()))
    return;
  const std::string reason = std::strerror(errno);
  ::unlink(path_.c_str());
  ::close(file_);
  throw Error(ErrorKind::Failed, "cannot be locked: " + reason, path_.string());
}

FileLock::~FileLock() {
  if (file_ < 0) return;
  // A file that others still hold must stay: to one who made it anew they would be unseen.
  if (::flock(file_, LOCK_EX | LOCK_NB) == 0 && is_file_at(file_, path_)) ::unlink(path_.c_str());
  ::close(file_);
}

FileLock::FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)), path_(std::move(other.path_)) {}

FileLock wait_for_lock(const fs::path& path, double seconds) {
  const Stopwatch watch;
  bool said = false;
  for (;;) {
    try {
      return FileLock(path);
    } catch (const AtWork& other) {
      if (watch.seconds() > seconds) throw;
      if (!std::exchange(said, true)) say(std::string("waits: ") + other.what());
    }
    stop_if_interrupted(path.string());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

bool is_left_lock(const fs::path& file) {
  std::error_code error;
  if (const auto bytes = fs::file_size(file, error); error || bytes > kLongestHolder) return false;
  static const std::regex holder("(pid [0-9]+ on [^\n]*\n)?");
  return std::regex_match(read_file(file, kLongestHolder, true), holder);
}

fs::path own_path(const fs::path& folder) {
  std::error_code error;
  const fs::path path = fs::weakly_canonical(fs::absolute(folder), error);
  if (error) throw usage_error("no such folder can be there: " + error.message(), folder.string());
  return path.has_filename() ? path : path.parent_path();
}

FolderLock::FolderLock(const fs::path& folder, LockKind kind) {
  const fs::path path = own_path(folder);
  const auto lock = [this](const fs::path& of, LockKind how) {
    locks_.emplace_back(of.parent_path() / ("." + of.filename().string() + ".lock"), how, of);
  };
  lock(path, kind);
  for (fs::path outer = path.parent_path(); outer != outer.parent_path(); outer = outer.parent_path())
    if (fs::exists(outer / kProvenanceName)) lock(outer, LockKind::Read);
}

}  // namespace clerestory
