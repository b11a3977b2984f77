// Weights and checkpoints in the safetensors format: 8 bytes of header length (little endian), a JSON header, the data.
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

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
  const std::vector<std::int32_t>& ints(const std::string& where = "tensor") const;
  const std::vector<std::uint64_t>& words(const std::string& where = "tensor") const;
};

struct TensorFile {
  std::map<std::string, StoredTensor> tensors;
  std::map<std::string, std::string> metadata;

  /// The tensor of this name, or usage_error naming `where` (the file), the name and the nearest known ones.
  const StoredTensor& get(const std::string& name, const std::string& where) const;
};

/// Reads F32, F16, BF16 and F64 as float, I32, and U64 and I64 (not negative) as 64-bit words. Everything is checked
/// before memory is taken: header length, JSON, dtype, shape against byte range, ranges inside the file, no overlap and
/// no gap. Throws usage_error naming file and tensor.
TensorFile read_safetensors(const std::filesystem::path& path);

enum class FloatStorage { F32, F16 };
/// Writes wide types first and equal ones in the order of their names, so equal content gives equal bytes. F16 rounds to nearest even and
/// throws Error on a finite value beyond 65504. Atomic.
void write_safetensors(const std::filesystem::path& path, const TensorFile& file,
                       FloatStorage storage = FloatStorage::F32);

}  // namespace clerestory
