// flock() on files that come and go.
#include "host/report/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "host/error.hpp"
#include "host/report/provenance.hpp"

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

}  // namespace

FileLock::FileLock(const fs::path& path, LockKind kind, const fs::path& guarded) : path_(path) {
  take(kind, guarded.empty() ? path : guarded);
}

void FileLock::take(LockKind kind, const fs::path& guarded) {
  for (;;) {
    file_ = ::open(path_.c_str(), O_RDONLY | O_CREAT | O_CLOEXEC, 0644);
    if (file_ < 0 && kind == LockKind::Read && may_not_write(errno)) return;
    if (file_ < 0) throw usage_error(std::string("cannot be locked: ") + std::strerror(errno), path_.string());
    if (::flock(file_, (kind == LockKind::Read ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0) {
      const int reason = errno;
      ::close(file_);
      if (reason != EWOULDBLOCK)
        throw Error(ErrorKind::Failed, std::string("cannot be locked: ") + std::strerror(reason), path_.string());
      throw usage_error("another process is at work here", guarded.string());
    }
    // The one before us may have deleted the file between our open and our lock: then we hold nothing that anyone sees.
    if (is_file_at(file_, path_)) return;
    ::close(file_);
  }
}

FileLock::~FileLock() {
  if (file_ < 0) return;
  // A file that others still hold must stay: to one who made it anew they would be unseen.
  if (::flock(file_, LOCK_EX | LOCK_NB) == 0 && is_file_at(file_, path_)) ::unlink(path_.c_str());
  ::close(file_);
}

FileLock::FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)), path_(std::move(other.path_)) {}

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
