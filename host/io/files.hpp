// Whole files: read with a bound, written under a temporary name in the same folder and renamed, so that a reader never
// sees half a file and a failure leaves the old one in place.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace clerestory {

/// A regular file open for reading. Throws usage_error when it is missing, a folder or unreadable, and when it turns
/// out shorter than asked for.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }
  void read(void* to, std::size_t bytes, std::uint64_t at) const;

 private:
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
};

/// Bytes of a regular file. Throws usage_error when it is missing, a folder, unreadable, empty (unless allowed) or
/// larger than `limit` (checked before memory is taken).
std::string read_file(const std::filesystem::path& path, std::uint64_t limit = std::uint64_t{1} << 32,
                      bool allow_empty = false);

/// Creates a folder and those above it. Throws usage_error when a file stands in the way or the place is not writable.
void make_directories(const std::filesystem::path& folder);

/// Removes a file, or a folder with all that is in it; what is not there is no fault. Throws Error (Failed) with the
/// system's reason.
void remove_tree(const std::filesystem::path& path);

/// A file being written: appears under its name on commit(), fsynced; without commit nothing remains. What a killed
/// process left of the same file is removed.
class AtomicFile {
 public:
  /// The folder must exist. Throws usage_error when `path` is a folder or its folder cannot be written.
  explicit AtomicFile(const std::filesystem::path& named);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Throws Error (Failed) with the system's reason, such as a full disk.
  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  void commit();

 private:
  std::filesystem::path path_, temporary_;
  int descriptor_ = -1;
};

/// AtomicFile in one call.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// FNV-1a, 64 bits: identity of files in provenance (against accident, not against malice).
std::uint64_t content_hash(std::string_view bytes, std::uint64_t seed = 0xcbf29ce484222325u);
/// content_hash of a file's bytes as 16 hexadecimal digits.
std::string file_hash(const std::filesystem::path& path);

}  // namespace clerestory
