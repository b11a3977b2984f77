#include "host/io/files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "host/error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

std::string reason(int code) { return std::generic_category().message(code); }

// A temporary name in the same folder, so that the rename stays inside one file system; unique over threads and
// processes that write the same file.
fs::path temporary_for(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return path.parent_path() / fmt::format(".{}.{}-{}.tmp", path.filename().string(), ::getpid(), counter++);
}

bool is_temporary_for(const fs::path& path, const std::string& name) {
  const std::string before = "." + path.filename().string() + ".", after = ".tmp";
  if (!name.starts_with(before) || !name.ends_with(after) || name.size() <= before.size() + after.size()) return false;
  return name.find_first_not_of("0123456789-", before.size()) == name.size() - after.size();
}

// A writer holds its temporary locked for as long as it lives; one that nobody holds was left by a process that was
// killed.
void remove_if_abandoned(const fs::path& temporary) {
  const int file = ::open(temporary.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) ::unlink(temporary.c_str());
  ::close(file);
}

void remove_abandoned_temporaries(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (is_temporary_for(path, entry->path().filename().string())) remove_if_abandoned(entry->path());
}

// Locked, and still there: between its making and its locking another process may have taken it for abandoned. Where
// the file system knows no locks, none is ever taken for abandoned.
bool keep_locked(int file) {
  while (::flock(file, LOCK_EX) != 0 && errno == EINTR) {
  }
  struct stat status {};
  return ::fstat(file, &status) != 0 || status.st_nlink > 0;
}

}  // namespace

InputFile::InputFile(const fs::path& path)
    : path_(path), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (descriptor_ < 0) throw usage_error("cannot be opened: " + reason(errno), path.string());
  struct stat status {};
  const int failed = ::fstat(descriptor_, &status);
  if (failed == 0 && S_ISREG(status.st_mode)) {
    size_ = static_cast<std::uint64_t>(status.st_size);
    return;
  }
  const std::string why = failed != 0 ? "cannot be read: " + reason(errno) : "is not a regular file";
  ::close(descriptor_);
  if (failed == 0 && S_ISDIR(status.st_mode)) throw usage_error("is a folder", path.string(), {}, "a file");
  throw usage_error(why, path.string());
}

InputFile::~InputFile() { ::close(descriptor_); }

void InputFile::read(void* to, std::size_t bytes, std::uint64_t at) const {
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t got =
        ::pread(descriptor_, static_cast<char*>(to) + done, bytes - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw usage_error("cannot be read: " + reason(errno), path_.string());
    if (got == 0) throw usage_error("ends too early", path_.string());
    done += static_cast<std::size_t>(got);
  }
}

std::string read_file(const fs::path& path, std::uint64_t limit, bool allow_empty) {
  const InputFile file(path);
  if (file.size() > limit)
    throw usage_error("is too large", path.string(), fmt::format("{} bytes", file.size()),
                      fmt::format("at most {}", limit));
  if (file.size() == 0 && !allow_empty) throw usage_error("is empty", path.string());
  std::string bytes(file.size(), '\0');
  file.read(bytes.data(), bytes.size(), 0);
  return bytes;
}

void make_directories(const fs::path& folder) {
  if (folder.empty()) return;
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) throw usage_error("the folder cannot be made: " + code.message(), folder.string());
  if (!fs::is_directory(folder)) throw usage_error("is a file", folder.string(), {}, "a folder");
}

void remove_tree(const fs::path& path) {
  std::error_code code;
  fs::remove_all(path, code);
  if (code) throw Error(ErrorKind::Failed, "cannot be removed: " + code.message(), path.string());
}

AtomicFile::AtomicFile(const fs::path& named) {
  if (!named.has_filename()) throw usage_error("is not the name of a file", named.string());
  std::error_code ignored;
  if (fs::is_directory(named, ignored)) throw usage_error("is a folder", named.string(), {}, "a file");
  // What a rename would put a file in the place of: a device, a pipe.
  if (const fs::file_status there = fs::status(named, ignored); fs::exists(there) && !fs::is_regular_file(there))
    throw usage_error("is not a regular file", named.string(), {}, "a file, or a new name");
  // The file behind a link is replaced, or made where there is none.
  path_ = named;
  if (fs::is_symlink(named, ignored))
    path_ = fs::exists(named, ignored) ? fs::canonical(named) : named.parent_path() / fs::read_symlink(named);
  const fs::path& path = path_;
  for (;;) {
    temporary_ = temporary_for(path);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && errno == EEXIST) {  // of a process that had our number; the next name is another
      remove_abandoned_temporaries(path);
      continue;
    }
    if (descriptor_ < 0) throw usage_error("cannot be written: " + reason(errno), path.string());
    if (keep_locked(descriptor_)) break;
    ::close(descriptor_);
  }
  remove_abandoned_temporaries(path);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;  // committed
  ::unlink(temporary_.c_str());
  ::close(descriptor_);
}

void AtomicFile::write(const void* data, std::size_t bytes) {
  const auto* from = static_cast<const char*>(data);
  for (std::size_t done = 0; done < bytes;) {
    const ssize_t put = ::write(descriptor_, from + done, bytes - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) throw Error(ErrorKind::Failed, "writing failed: " + reason(errno), path_.string());
    done += static_cast<std::size_t>(put);
  }
}

void AtomicFile::commit() {
  // fsync before the rename: after a power cut the name must not point at missing data. Some file systems report a
  // full disk only here.
  if (::fsync(descriptor_) != 0 && errno != EINVAL)
    throw Error(ErrorKind::Failed, "writing failed: " + reason(errno), path_.string());
  // The rename comes before the close, which ends the lock.
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    throw Error(ErrorKind::Failed, "writing failed: " + reason(errno), path_.string());
  ::close(descriptor_);
  descriptor_ = -1;
}

void write_file(const fs::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

std::uint64_t content_hash(std::string_view bytes, std::uint64_t seed) {
  std::uint64_t hash = seed;
  for (char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

std::string file_hash(const fs::path& path) {
  return fmt::format("{:016x}", content_hash(read_file(path, std::uint64_t{1} << 32, true)));
}

}  // namespace clerestory
