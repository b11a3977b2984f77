#include "tracer/column_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFirstLine = "clerestory rooms\n";
constexpr std::uint64_t kMostBytes = 1 << 28;  // packed, and unpacked
constexpr std::ptrdiff_t kMostNames = 1 << 20;
constexpr std::uint64_t kMostPacking = 1040;  // deflate packs 1032 to 1 at best

std::string last_line(std::string_view bytes) { return fmt::format("\nhash {:016x}\n", content_hash(bytes)); }

static_assert(std::endian::native == std::endian::little, "as numbers lie in files");
std::string bytes_of(std::uint64_t number) { return {reinterpret_cast<const char*>(&number), sizeof number}; }
std::uint64_t number_at(const char* bytes) {
  std::uint64_t number;
  std::memcpy(&number, bytes, sizeof number);
  return number;
}

}  // namespace

void ColumnWriter::append(const void* values, std::uint64_t count, std::size_t size) {
  columns_ += bytes_of(count);
  const auto* bytes = static_cast<const char*>(values);
  for (std::size_t b = 0; b < size; ++b)
    for (std::size_t i = 0; i < count; ++i) columns_ += bytes[i * size + b];
}

void ColumnWriter::names(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  append(text.data(), text.size(), 1);
}

std::string packed_columns(std::string_view columns) {
  if (columns.size() > kMostBytes)
    throw usage_error("more rooms than a file holds", "file of rooms", fmt::format("{} bytes", columns.size()),
                      fmt::format("at most {}", kMostBytes));
  uLongf size = compressBound(columns.size());
  std::string stream(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(stream.data()), &size, reinterpret_cast<const Bytef*>(columns.data()),
                columns.size(), Z_BEST_COMPRESSION) != Z_OK)
    throw Error(ErrorKind::Failed, "zlib cannot pack a file of rooms");
  stream.resize(size);
  const std::string bytes = std::string(kFirstLine) + bytes_of(columns.size()) + stream;
  return bytes + last_line(bytes);
}

ColumnReader::ColumnReader(const fs::path& path) : path_(path) {
  const std::string file = read_file(path, kMostBytes);
  const std::size_t packed = kFirstLine.size() + sizeof(std::uint64_t), hash = last_line("").size();
  if (!file.starts_with(kFirstLine) || file.size() < packed + hash)
    fail("another file", "another first line", "what `clerestory generate --write-rooms` wrote");
  const std::string_view bytes(file.data(), file.size() - hash);
  if (file.substr(bytes.size()) != last_line(bytes))
    fail("damaged", "bytes that do not give its hash", "what `clerestory generate --write-rooms` wrote");
  const std::uint64_t size = number_at(file.data() + kFirstLine.size()), most = bytes.size() * kMostPacking;
  if (size > std::min(most, kMostBytes))
    fail("claims more than it can hold", fmt::format("{} bytes", size),
         fmt::format("at most {}", std::min(most, kMostBytes)));
  columns_.resize(size);
  uLongf unpacked = size;
  if (uncompress(reinterpret_cast<Bytef*>(columns_.data()), &unpacked,
                 reinterpret_cast<const Bytef*>(bytes.data() + packed), bytes.size() - packed) != Z_OK ||
      unpacked != size)
    fail("does not unpack", "another zlib stream", fmt::format("one of {} bytes", size));
}

std::size_t ColumnReader::count_of(const char* name, std::size_t wanted, std::size_t size) {
  const std::size_t left = columns_.size() - at_;
  if (left < sizeof(std::uint64_t)) fail("a column is missing", name, "all of them");
  const std::uint64_t count = number_at(columns_.data() + at_);
  if (wanted != kAny && count != wanted)
    fail("a column has another length", fmt::format("{}: {}", name, count), fmt::format("{}", wanted));
  if (count > (left - sizeof count) / size)
    fail("a column is longer than the file", fmt::format("{}: {}", name, count), "less");
  at_ += sizeof count;
  return count;
}

void ColumnReader::take(void* to, std::size_t count, std::size_t size) {
  auto* bytes = static_cast<char*>(to);
  for (std::size_t b = 0; b < size; ++b)
    for (std::size_t i = 0; i < count; ++i) bytes[i * size + b] = columns_[at_++];
}

template <class T>
void ColumnReader::check_finite(const char* name, const std::vector<T>& values) const {
  if constexpr (std::is_floating_point_v<T>)
    if (!std::ranges::all_of(values, [](T v) { return std::isfinite(v); }))
      fail("a number is not finite", name, "finite numbers");
}
template void ColumnReader::check_finite(const char*, const std::vector<float>&) const;
template void ColumnReader::check_finite(const char*, const std::vector<double>&) const;
template void ColumnReader::check_finite(const char*, const std::vector<std::uint8_t>&) const;
template void ColumnReader::check_finite(const char*, const std::vector<std::int32_t>&) const;
template void ColumnReader::check_finite(const char*, const std::vector<std::uint64_t>&) const;

std::vector<std::string> ColumnReader::names(const char* name) {
  const std::vector<std::uint8_t> text = column<std::uint8_t>(name);
  if (const auto count = std::ranges::count(text, '\n'); count > kMostNames || (!text.empty() && text.back() != '\n'))
    fail("names are no lines, or too many", fmt::format("{}: {}", name, count), fmt::format("at most {}", kMostNames));
  std::vector<std::string> lines;
  for (auto begin = text.begin(); begin != text.end();) {
    const auto end = std::find(begin, text.end(), '\n');
    lines.emplace_back(begin, end);
    begin = end + 1;
  }
  return lines;
}

void ColumnReader::end() const {
  if (at_ != columns_.size())
    fail("more than its columns", fmt::format("{} bytes behind them", columns_.size() - at_), "nothing");
}

void ColumnReader::fail(const std::string& what, const std::string& found, const std::string& expected) const {
  throw usage_error("file of rooms: " + what, path_.string(), found, expected);
}

}  // namespace clerestory
