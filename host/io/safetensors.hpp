// Weights and checkpoints in the safetensors format: 8 bytes of header length (little endian), a JSON header, the data.
// What is written here has checksums in its metadata, FNV-1a of 64 bits (content_hash), 16 hexadecimal digits each:
// `tensor_checksums`, a JSON object with one for the stored bytes of each tensor, and `header_checksum`, of the
// header's JSON without this key. FNV-1a maps states one to one, so a single wrong byte never passes, others one time
// in 2^64.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "host/io/files.hpp"

namespace clerestory {

struct StoredTensor {
  std::vector<long> shape;  // empty: a scalar
  std::variant<std::vector<float>, std::vector<std::int32_t>, std::vector<std::uint64_t>> values;

  StoredTensor() = default;
  template <class T>
  StoredTensor(std::vector<long> s, std::vector<T> v) : shape(std::move(s)), values(std::move(v)) {}

  std::size_t count() const;
  /// The values, or usage_error naming `where` when they are of another type.
  const std::vector<float>& floats(const std::string& where = "tensor") const;
  const std::vector<std::uint64_t>& words(const std::string& where = "tensor") const;
};

struct TensorFile {
  std::map<std::string, StoredTensor> tensors;
  std::map<std::string, std::string> metadata;
  bool checksummed = false;  // set by reading: the file kept checksums, and they agree

  /// The tensor of this name, or usage_error naming `where` (the file), the name and the nearest known ones.
  const StoredTensor& get(const std::string& name, const std::string& where) const;
};

/// The first value that is no finite number as "nan at 12"; empty when all are finite.
std::string not_finite(const StoredTensor& tensor);

/// Reads F32, F16, BF16 and F64 as float, I32, and U64 and I64 (not negative) as 64-bit words. Everything is checked
/// before memory is taken: header length, JSON, dtype, shape against byte range, ranges inside the file, no overlap and
/// no gap; and the checksums, where the file has them. They are not among the metadata that come back. Throws
/// usage_error naming file and tensor.
TensorFile read_safetensors(const std::filesystem::path& path);

/// The same, for weights and what goes on from them: throws usage_error naming the file, the tensor and the place of
/// the first value that is not finite.
TensorFile read_finite_safetensors(const std::filesystem::path& path);

enum class FloatStorage { F32, F16 };
/// Writes wide types first and equal ones in the order of their names, so equal content gives equal bytes. F16 rounds
/// to nearest even and throws Error on a finite value beyond 65504. Atomic: both of two files that belong together by
/// writing them before either is committed.
void write_safetensors(AtomicFile& out, const std::string& where, const TensorFile& file, FloatStorage storage);
void write_safetensors(const std::filesystem::path& path, const TensorFile& file,
                       FloatStorage storage = FloatStorage::F32);

}  // namespace clerestory
