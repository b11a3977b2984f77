#include "host/io/safetensors.hpp"

#include <Imath/half.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "host/error.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

static_assert(std::endian::native == std::endian::little, "the format is little endian");

using Json = nlohmann::json;

constexpr std::uint64_t max_header = 100'000'000;  // bytes, the limit of the format's own reader
constexpr float half_max = 65504;
constexpr const char* metadata_key = "__metadata__";
constexpr const char* header_checksum_key = "header_checksum";
constexpr const char* tensor_checksums_key = "tensor_checksums";

struct DType {
  const char* name;
  std::uint64_t size;
};
constexpr DType known_types[] = {{"F32", 4}, {"F16", 2}, {"BF16", 2}, {"F64", 8}, {"I32", 4}, {"I64", 8}, {"U64", 8}};

struct Entry {
  std::string name, dtype;
  std::vector<long> shape;
  std::uint64_t count = 1, begin = 0, end = 0;  // values; bytes from the start of the data
};

std::uint64_t whole(const Json& value, const std::string& what, const std::string& where) {
  // 2^53: far beyond any file, and products of two such numbers are checked below.
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > (std::uint64_t{1} << 53))
    throw usage_error("wrong " + what, where, brief(value), "a whole number, not negative");
  return value.get<std::uint64_t>();
}

Entry parse_entry(const std::string& name, const Json& json, std::uint64_t data_bytes, const std::string& file) {
  const std::string where = file + ": tensor " + name;
  if (!json.is_object() || !json.contains("dtype") || !json.contains("shape") || !json.contains("data_offsets"))
    throw usage_error("wrong header entry", where, brief(json), "dtype, shape and data_offsets");
  Entry entry;
  entry.name = name;
  entry.dtype = json["dtype"].is_string() ? json["dtype"].get<std::string>() : brief(json["dtype"]);
  const auto type = std::find_if(std::begin(known_types), std::end(known_types),
                                 [&](const DType& t) { return entry.dtype == t.name; });
  if (type == std::end(known_types))
    throw usage_error("unknown dtype", where, entry.dtype, "F32, F16, BF16, F64, I32, I64 or U64");
  const Json &shape = json["shape"], &offsets = json["data_offsets"];
  if (!shape.is_array()) throw usage_error("wrong shape", where, brief(shape), "an array");
  if (!offsets.is_array() || offsets.size() != 2)
    throw usage_error("wrong data_offsets", where, brief(offsets), "two numbers");
  entry.begin = whole(offsets[0], "data_offsets", where), entry.end = whole(offsets[1], "data_offsets", where);
  if (entry.begin > entry.end || entry.end > data_bytes)
    throw usage_error("data_offsets lie outside the file", where, brief(offsets),
                      fmt::format("a range in 0 to {}", data_bytes));
  const bool empty = std::any_of(shape.begin(), shape.end(), [](const Json& size) { return size == 0; });
  for (const Json& dimension : shape) {
    const std::uint64_t size = whole(dimension, "shape", where);
    // Refused before the product can overflow; a shape with a zero may be as large as it likes elsewhere.
    if (!empty && size != 0 && entry.count > data_bytes / size)
      throw usage_error("the shape is larger than the file", where, brief(shape));
    entry.count *= size;
    entry.shape.push_back(static_cast<long>(size));
  }
  if (entry.count * type->size != entry.end - entry.begin)
    throw usage_error("shape and data_offsets disagree", where, fmt::format("{} bytes", entry.end - entry.begin),
                      fmt::format("{} values of {}, {} bytes", entry.count, entry.dtype, entry.count * type->size));
  return entry;
}

// Ranges must follow each other from the first byte of the data to the last.
void check_coverage(std::vector<Entry>& entries, std::uint64_t data_bytes, const std::string& where) {
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return std::pair(a.begin, a.end) < std::pair(b.begin, b.end); });
  std::uint64_t at = 0;
  for (const Entry& e : entries) {
    if (e.begin != at)
      throw usage_error(e.begin < at ? "tensors overlap" : "bytes belong to no tensor", where + ": tensor " + e.name,
                        fmt::format("begins at {}", e.begin), fmt::format("{}", at));
    at = e.end;
  }
  if (at != data_bytes)
    throw usage_error("bytes after the last tensor", where, fmt::format("{}", data_bytes), fmt::format("{}", at));
}

std::string checksum(std::string_view bytes) { return fmt::format("{:016x}", content_hash(bytes)); }

template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Takes the checksums out of a header and compares its own. Returns those of the tensors; null for a file that has
/// none, which another program wrote.
Json take_checksums(Json& header, const std::string& where) {
  const auto metadata = header.find(metadata_key);
  if (metadata == header.end() || !metadata->is_object()) return {};
  const bool of_tensors = metadata->contains(tensor_checksums_key) && (*metadata)[tensor_checksums_key].is_string();
  const bool of_header = metadata->contains(header_checksum_key);
  if (!of_tensors && !of_header) return {};
  const std::string expected = of_header ? brief((*metadata)[header_checksum_key]) : "none";
  metadata->erase(header_checksum_key);
  const std::string found = checksum(header.dump());
  if (!of_tensors || expected != '"' + found + '"')
    throw usage_error("the header is damaged", where, "checksum " + found, expected);
  Json checksums = parse_json_object((*metadata)[tensor_checksums_key].get<std::string>(), where);
  metadata->erase(tensor_checksums_key);
  return checksums;
}

struct Data {  // of an open file
  const InputFile& file;
  std::uint64_t at;
  Json checksums;  // by tensor; null: none are kept
  std::string where;
};

template <class T>
std::vector<T> raw(const Data& data, const Entry& entry) {
  std::vector<T> values(entry.count);
  data.file.read(values.data(), values.size() * sizeof(T), data.at + entry.begin);
  if (data.checksums.is_null()) return values;
  const std::string found = checksum(bytes_of(values));
  if (const Json expected = data.checksums.value(entry.name, Json()); expected != found)
    throw usage_error("the tensor is damaged", data.where + ": tensor " + entry.name, "checksum " + found,
                      brief(expected));
  return values;
}

StoredTensor load(const Data& data, const Entry& entry) {
  const auto convert = [&]<class From>(auto to_float) {
    const std::vector<From> from = raw<From>(data, entry);
    std::vector<float> to(from.size());
    std::transform(from.begin(), from.end(), to.begin(), to_float);
    return StoredTensor(entry.shape, std::move(to));
  };
  if (entry.dtype == "F32") return {entry.shape, raw<float>(data, entry)};
  if (entry.dtype == "F16")
    return convert.operator()<std::uint16_t>([](std::uint16_t bits) { return imath_half_to_float(bits); });
  if (entry.dtype == "BF16")
    return convert.operator()<std::uint16_t>([](std::uint32_t bits) { return std::bit_cast<float>(bits << 16); });
  if (entry.dtype == "F64") return convert.operator()<double>([](double v) { return static_cast<float>(v); });
  if (entry.dtype == "I32") return {entry.shape, raw<std::int32_t>(data, entry)};
  std::vector<std::uint64_t> words = raw<std::uint64_t>(data, entry);
  if (entry.dtype == "I64" && std::any_of(words.begin(), words.end(), [](std::uint64_t w) { return w >> 63; }))
    throw usage_error("I64 holds negative values, which are not read", data.where + ": tensor " + entry.name);
  return {entry.shape, std::move(words)};
}

template <class T>
const std::vector<T>& values_as(const StoredTensor& tensor, const char* type, const std::string& where) {
  static constexpr const char* names[] = {"floats", "32-bit integers", "64-bit words"};
  if (const auto* values = std::get_if<std::vector<T>>(&tensor.values)) return *values;
  throw usage_error("the tensor has another type", where, names[tensor.values.index()], type);
}

struct Stored {  // one tensor on its way into a file
  std::string name, dtype;
  std::uint64_t size;
  const StoredTensor* tensor;
  std::vector<std::uint16_t> halves;  // the values, where dtype is F16

  std::string_view bytes() const {
    return dtype == "F16" ? bytes_of(halves) : std::visit([](const auto& v) { return bytes_of(v); }, tensor->values);
  }
};

void check_shape(const Stored& s, const std::string& where) {
  std::uint64_t count = 1;
  for (long d : s.tensor->shape) count *= static_cast<std::uint64_t>(d);
  if (count != s.tensor->count())
    throw Error(ErrorKind::Failed, "shape and number of values disagree", where + ": tensor " + s.name,
                fmt::format("{} values", s.tensor->count()), fmt::format("{}", count));
}

std::vector<std::uint16_t> to_half(const std::vector<float>& values, const std::string& where) {
  std::vector<std::uint16_t> halves(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i]) && std::abs(values[i]) > half_max)
      throw Error(ErrorKind::Failed, "a value does not fit into half precision", where,
                  fmt::format("{} at {}", values[i], i), fmt::format("at most {}", half_max));
    halves[i] = imath_float_to_half(values[i]);
  }
  return halves;
}

Stored describe(const std::string& name, const StoredTensor& tensor, FloatStorage storage, const std::string& where) {
  if (std::holds_alternative<std::vector<std::int32_t>>(tensor.values)) return {name, "I32", 4, &tensor, {}};
  if (std::holds_alternative<std::vector<std::uint64_t>>(tensor.values)) return {name, "U64", 8, &tensor, {}};
  if (storage == FloatStorage::F32) return {name, "F32", 4, &tensor, {}};
  return {name, "F16", 2, &tensor, to_half(tensor.floats(), where + ": tensor " + name)};
}

}  // namespace

std::string not_finite(const StoredTensor& tensor) {
  const auto* values = std::get_if<std::vector<float>>(&tensor.values);
  if (values == nullptr) return {};
  const auto found = std::find_if(values->begin(), values->end(), [](float v) { return !std::isfinite(v); });
  return found == values->end() ? "" : fmt::format("{} at {}", *found, found - values->begin());
}

std::size_t StoredTensor::count() const {
  return std::visit([](const auto& v) { return v.size(); }, values);
}
const std::vector<float>& StoredTensor::floats(const std::string& where) const {
  return values_as<float>(*this, "floats", where);
}
const std::vector<std::uint64_t>& StoredTensor::words(const std::string& where) const {
  return values_as<std::uint64_t>(*this, "64-bit words", where);
}

const StoredTensor& TensorFile::get(const std::string& name, const std::string& where) const {
  if (const auto found = tensors.find(name); found != tensors.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, tensor] : tensors) names.push_back(known);
  throw usage_error("the tensor " + name + " is missing", where,
                    names.empty() ? "no tensors" : "nearest: " + nearest_word(name, names));
}

TensorFile read_safetensors(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile input(path);
  if (input.size() < 8) throw usage_error("is no safetensors file", where, fmt::format("{} bytes", input.size()));
  std::uint64_t header_bytes = 0;
  input.read(&header_bytes, 8, 0);
  if (header_bytes > max_header || header_bytes > input.size() - 8)
    throw usage_error("is no safetensors file, or truncated", where, fmt::format("a header of {} bytes", header_bytes),
                      fmt::format("at most {}", std::min(max_header, input.size() - 8)));
  std::string text(header_bytes, '\0');
  input.read(text.data(), text.size(), 8);
  Json header = parse_json_object(text, where);

  const std::uint64_t data_bytes = input.size() - 8 - header_bytes;
  const Data data{input, 8 + header_bytes, take_checksums(header, where), where};
  TensorFile file;
  file.checksummed = !data.checksums.is_null();
  std::vector<Entry> entries;
  for (const auto& [name, value] : header.items()) {
    if (name != metadata_key) {
      entries.push_back(parse_entry(name, value, data_bytes, where));
      continue;
    }
    if (!value.is_object()) throw usage_error("wrong metadata", where, brief(value), "an object of texts");
    for (const auto& [key, text_value] : value.items()) {
      if (!text_value.is_string()) throw usage_error("metadata must be text", where, key + ": " + brief(text_value));
      file.metadata[key] = text_value.get<std::string>();
    }
  }
  check_coverage(entries, data_bytes, where);
  for (const Entry& entry : entries) file.tensors.emplace(entry.name, load(data, entry));
  return file;
}

TensorFile read_finite_safetensors(const std::filesystem::path& path) {
  TensorFile file = read_safetensors(path);
  for (const auto& [name, tensor] : file.tensors)
    if (const std::string found = not_finite(tensor); !found.empty())
      throw usage_error("a value is not finite", fmt::format("{}: tensor {}", path.string(), name), found);
  return file;
}

void write_safetensors(AtomicFile& out, const std::string& where, const TensorFile& file, FloatStorage storage) {
  std::vector<Stored> order;
  for (const auto& [name, tensor] : file.tensors) {
    if (name == metadata_key) throw Error(ErrorKind::Failed, "this name is taken by the format", where, name);
    order.push_back(describe(name, tensor, storage, where));
    check_shape(order.back(), where);
  }
  // Wide types first keeps every tensor aligned; names decide among equals.
  std::stable_sort(order.begin(), order.end(), [](const Stored& a, const Stored& b) { return a.size > b.size; });

  Json header = Json::object(), checksums = Json::object();
  Json& metadata = header[metadata_key] = file.metadata;
  std::uint64_t at = 0;
  for (const Stored& s : order) {
    const std::uint64_t end = at + s.tensor->count() * s.size;
    header[s.name] = {{"dtype", s.dtype}, {"shape", s.tensor->shape}, {"data_offsets", {at, end}}};
    checksums[s.name] = checksum(s.bytes());
    at = end;
  }
  std::string text;
  try {
    metadata[tensor_checksums_key] = checksums.dump();
    metadata[header_checksum_key] = checksum(header.dump());
    text = header.dump();
  } catch (const Json::exception& error) {
    throw Error(ErrorKind::Failed, std::string("a name or the metadata is no UTF-8: ") + error.what(), where);
  }
  text.resize((text.size() + 7) / 8 * 8, ' ');

  const std::uint64_t header_bytes = text.size();
  out.write(&header_bytes, 8);
  out.write(text);
  for (const Stored& s : order) out.write(s.bytes());
}

void write_safetensors(const std::filesystem::path& path, const TensorFile& file, FloatStorage storage) {
  AtomicFile out(path);
  write_safetensors(out, path.string(), file, storage);
  out.commit();
}

}  // namespace clerestory
