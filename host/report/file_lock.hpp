// Locks that keep processes out of each other's folders and end with the process, however it ends.
#pragma once
#include <filesystem>
#include <vector>

#include "host/error.hpp"

namespace clerestory {

/// Any number of readers, or one writer.
enum class LockKind { Read, Write };

/// Another process holds what was asked for; the message says which, "pid 4711 on HOST", where it writes there.
class AtWork : public Error {
 public:
  using Error::Error;
};

/// Throws AtWork (ErrorKind::Usage) naming `guarded` when another process holds the file in a way that excludes `kind`.
/// A writer's name stands in the file. The last holder removes it.
class FileLock {
 public:
  explicit FileLock(const std::filesystem::path& path, LockKind kind = LockKind::Write,
                    const std::filesystem::path& guarded = {});
  ~FileLock();
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&&) = delete;

 private:
  void take(LockKind kind, const std::filesystem::path& guarded);
  void write_holder() const;
  int file_ = -1;  // -1: moved from, or nothing to lock
  std::filesystem::path path_;
};

/// The lock for writing as soon as nobody else holds the file. Throws AtWork when that takes longer than `seconds`, and
/// ErrorKind::Interrupted.
FileLock wait_for_lock(const std::filesystem::path& path, double seconds);

/// Whether a file is what such a lock leaves when its holder is killed: empty, or with a holder's name and no more.
bool is_left_lock(const std::filesystem::path& file);

/// A folder of results while it is read, or written into or replaced: `.NAME.lock` beside it, for a folder that may be
/// replaced as a whole holds no lock of its own. Run folders that it lies in (RUN/edit) are locked for reading.
class FolderLock {
 public:
  FolderLock(const std::filesystem::path& folder, LockKind kind);

 private:
  std::vector<FileLock> locks_;
};

/// The folder's own path, whatever links and dots it was named by, without a separator at its end.
std::filesystem::path own_path(const std::filesystem::path& folder);

}  // namespace clerestory
