// Numbers in columns, one after another, deflated together: what is alike takes few bytes. A file is a line that says
// what it is, the size of the columns (8 bytes, little endian), a zlib stream, and a line with the hash of all before
// it. A column is its count (8 bytes), then of all its numbers the first byte, then of all the second, and so on.
#pragma once
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace clerestory {

class ColumnWriter {
 public:
  /// float, double, std::uint8_t, std::int32_t or std::uint64_t.
  template <class T>
  void column(const std::vector<T>& values) {
    append(values.data(), values.size(), sizeof(T));
  }
  /// A line each, none with a line's end in it.
  void names(const std::vector<std::string>& lines);

  const std::string& columns() const { return columns_; }

 private:
  void append(const void* values, std::uint64_t count, std::size_t size);

  std::string columns_;
};

/// The bytes of a file. Equal columns give equal bytes. Throws usage_error beyond 256 MiB, which would not be read.
std::string packed_columns(std::string_view columns);

/// Reads columns in the order of their writing. All functions throw usage_error naming the file and what is wrong.
class ColumnReader {
 public:
  /// What is no such file, or damaged, or larger than 256 MiB when unpacked, is refused before memory is taken.
  explicit ColumnReader(const std::filesystem::path& path);

  static constexpr std::size_t kAny = std::numeric_limits<std::size_t>::max();
  /// The next column, which has `wanted` numbers, all of them finite. `name` is for messages.
  template <class T>
  std::vector<T> column(const char* name, std::size_t wanted = kAny) {
    std::vector<T> values(count_of(name, wanted, sizeof(T)));
    take(values.data(), values.size(), sizeof(T));
    check_finite(name, values);
    return values;
  }
  std::vector<std::string> names(const char* name);
  const std::filesystem::path& path() const { return path_; }
  /// Nothing is left.
  void end() const;

  [[noreturn]] void fail(const std::string& what, const std::string& found, const std::string& expected) const;

 private:
  std::size_t count_of(const char* name, std::size_t wanted, std::size_t size);
  void take(void* to, std::size_t count, std::size_t size);
  template <class T>
  void check_finite(const char* name, const std::vector<T>& values) const;

  std::filesystem::path path_;
  std::string columns_;
  std::size_t at_ = 0;
};

}  // namespace clerestory
