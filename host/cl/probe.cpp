#include "host/cl/probe.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>

#include "host/cl/disk_cache.hpp"

namespace clerestory {
namespace {

constexpr const char* file = "tensor/probe.cl";

std::vector<float> small_integers(std::size_t count, std::uint32_t seed) {
  std::vector<float> values(count);
  for (float& value : values) {
    seed = seed * 1664525u + 1013904223u;
    value = static_cast<float>(static_cast<int>(seed >> 28) - 8);
  }
  return values;
}

Buffer upload(Device& device, const std::vector<float>& values) {
  Buffer buffer = device.allocate(values.size() * sizeof(float));
  device.write(buffer, values.data(), buffer.bytes());
  return buffer;
}

std::vector<float> download(Device& device, const Buffer& buffer) {
  std::vector<float> values(buffer.bytes() / sizeof(float));
  device.read(buffer, values.data(), buffer.bytes());
  return values;
}

std::string product_fault(Device& device, const Defines& defines) {
  constexpr int rows = 12, columns = 32;  // the register tile, as in the packed matrix product
  constexpr int row_panels = 2, column_panels = 3, depth = 37;
  const std::vector<float> a = small_integers(row_panels * rows * depth, 1),
                           b = small_integers(column_panels * columns * depth, 2);
  const Buffer a_packed = upload(device, a), b_packed = upload(device, b);
  const Buffer c = device.allocate(sizeof(float) * row_panels * rows * column_panels * columns);
  const Kernel kernel = device.kernel(file, "probe_product", defines);
  device.launch(kernel, Range::of2(row_panels, column_panels, 1, 1), a_packed, b_packed, c, depth);
  const std::vector<float> found = download(device, c);
  for (int i = 0; i < row_panels * rows; ++i)
    for (int j = 0; j < column_panels * columns; ++j) {
      int expected = 0;  // at most 37 * 64: every partial sum is exact in float
      for (int k = 0; k < depth; ++k)
        expected += static_cast<int>(a[(i / rows * depth + k) * rows + i % rows]) *
                    static_cast<int>(b[(j / columns * depth + k) * columns + j % columns]);
      const float value = found[i * column_panels * columns + j];
      if (value != static_cast<float>(expected))
        return fmt::format("a matrix product of whole numbers gives {} at ({}, {}) instead of {}", value, i, j,
                           expected);
    }
  return {};
}

struct Function {
  const char* name;
  std::function<double(double)> truth;
  double ulp;  // OpenCL C 1.2, section 7.4, single precision
};

std::string function_fault(Device& device, const Defines& defines) {
  constexpr int count = 256;
  std::vector<float> x(count);
  for (int i = 0; i < count; ++i) x[i] = 0.01f + 0.05f * static_cast<float>(i);
  const Function functions[] = {{"exp", [](double v) { return std::exp(v); }, 3},
                                {"log", [](double v) { return std::log(v); }, 3},
                                {"sin", [](double v) { return std::sin(v); }, 4},
                                {"sqrt", [](double v) { return std::sqrt(v); }, 3},
                                {"1/x", [](double v) { return 1 / v; }, 2.5}};
  const Buffer input = upload(device, x);
  const Buffer output = device.allocate(sizeof(float) * count * std::size(functions));
  device.launch(device.kernel(file, "probe_functions", defines), Range::of(count / 16, 1), input, output, count / 16);
  const std::vector<float> found = download(device, output);
  for (std::size_t f = 0; f < std::size(functions); ++f)
    for (int i = 0; i < count; ++i) {
      const double expected = functions[f].truth(x[i]);
      const double value = found[f * count + i];
      // One ulp is at most 2^-23 of the magnitude.
      if (!(std::abs(value - expected) <= functions[f].ulp * 0x1p-23 * std::abs(expected)))
        return fmt::format("{} of {} gives {} instead of {}", functions[f].name, x[i], value, expected);
    }
  return {};
}

std::string memory_fault(Device& device) {
  std::vector<unsigned char> sent(4099), found(sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<unsigned char>(i * 131 + i / 256);
  const Buffer first = device.allocate(sent.size()), second = device.allocate(sent.size());
  device.write(first, sent.data(), sent.size());
  device.zero(second, sent.size());
  device.copy(first, second, sent.size() - 5, 3, 1);
  device.read(second, found.data(), found.size());
  std::vector<unsigned char> expected(sent.size(), 0);
  std::memcpy(expected.data() + 1, sent.data() + 3, sent.size() - 5);
  return found == expected ? "" : "a buffer that was written, copied and read back has other bytes";
}

}  // namespace

std::string probe_fault(Device& device, const Defines& defines) {
  if (std::string fault = memory_fault(device); !fault.empty()) return fault;
  if (std::string fault = product_fault(device, defines); !fault.empty()) return fault;
  return function_fault(device, defines);
}

std::string remembered_probe_fault(Device& device) {
  const DiskCache cache;
  const std::string key = device.fingerprint() + "\n" + kernel_source(file);
  if (const auto verdict = cache.load("probe", key)) return *verdict;
  std::string fault;
  try {
    fault = probe_fault(device);
  } catch (const Error& error) {
    return error.what();
  }
  cache.store("probe", key, fault);
  return fault;
}

}  // namespace clerestory
