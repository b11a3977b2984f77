#include "host/cl/probe.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>

#include "host/cl/disk_cache.hpp"
#include "host/cl/platforms.hpp"
#include "host/cl/small_integers.hpp"

namespace clerestory {
namespace {

constexpr const char* file = "tensor/probe.cl";

template <class Real>
constexpr Precision precision_of = sizeof(Real) == 4 ? Precision::Single : Precision::Double;

template <class Real>
Buffer upload(Device& device, const std::vector<Real>& values) {
  Buffer buffer = device.allocate(values.size() * sizeof(Real));
  device.write(buffer, values.data(), buffer.bytes());
  return buffer;
}

template <class Real>
std::vector<Real> download(Device& device, const Buffer& buffer) {
  std::vector<Real> values(buffer.bytes() / sizeof(Real));
  device.read(buffer, values.data(), buffer.bytes());
  return values;
}

template <class Real>
std::string product_fault(Device& device, const Defines& defines) {
  constexpr int rows = 12, columns = 32;  // the register tile, as in the packed matrix product
  constexpr int row_panels = 2, column_panels = 3, period = 37, depth = 70'001;
  const auto a = small_integers<Real>(row_panels * rows * period, 1, 4);
  const auto b = small_integers<Real>(column_panels * columns * period, 2, 4);
  const Buffer a_packed = upload(device, a), b_packed = upload(device, b);
  const Buffer c = device.allocate(sizeof(Real) * row_panels * rows * column_panels * columns);
  const Kernel kernel = device.kernel(file, "probe_product", defines, precision_of<Real>);
  device.launch(kernel, Range::of2(row_panels, column_panels, 1, 1), a_packed, b_packed, c, depth, period);
  const std::vector<Real> found = download<Real>(device, c);
  for (int i = 0; i < row_panels * rows; ++i)
    for (int j = 0; j < column_panels * columns; ++j) {
      int expected = 0;  // at most 70001 * 64 < 2^24: every partial sum is exact in float
      for (int k = 0; k < period; ++k)
        expected += (depth / period + (k < depth % period)) *
                    static_cast<int>(a[(i / rows * period + k) * rows + i % rows]) *
                    static_cast<int>(b[(j / columns * period + k) * columns + j % columns]);
      const Real value = found[i * column_panels * columns + j];
      if (value != static_cast<Real>(expected))
        return fmt::format("a matrix product of whole numbers gives {} at ({}, {}) instead of {}", value, i, j,
                           expected);
    }
  return {};
}

struct Function {
  const char* name;
  long double (*truth)(long double);
  double ulp;  // OpenCL C 1.2, section 7.4: the larger of the bounds for single and double precision
};

constexpr Function functions[] = {{"exp", [](long double x) { return std::exp(x); }, 3},
                                  {"log", [](long double x) { return std::log(x); }, 3},
                                  {"sin", [](long double x) { return std::sin(x); }, 4},
                                  {"sqrt", [](long double x) { return std::sqrt(x); }, 3},
                                  {"reciprocal", [](long double x) { return 1 / x; }, 2.5}};

template <class Real>
std::string function_fault(Device& device, const Defines& defines) {
  constexpr int count = 256;
  std::vector<Real> x(count);
  for (int i = 0; i < count; ++i) x[i] = static_cast<Real>(0.01) + static_cast<Real>(0.05) * static_cast<Real>(i);
  const Buffer input = upload(device, x);
  const Buffer output = device.allocate(sizeof(Real) * count * std::size(functions));
  const Kernel kernel = device.kernel(file, "probe_functions", defines, precision_of<Real>);
  device.launch(kernel, Range::of(count / 16, 1), input, output, count / 16);
  const std::vector<Real> found = download<Real>(device, output);
  for (std::size_t f = 0; f < std::size(functions); ++f)
    for (int i = 0; i < count; ++i) {
      const long double expected = functions[f].truth(x[i]);
      const Real value = found[f * count + i];
      // One ulp is at most epsilon times the magnitude.
      const long double tolerance = functions[f].ulp * std::numeric_limits<Real>::epsilon() * std::abs(expected);
      if (!(std::abs(value - expected) <= tolerance))
        return fmt::format("{} of {} gives {} instead of {}", functions[f].name, x[i], value,
                           static_cast<Real>(expected));
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

std::string probe_fault(Device& device, Precision precision, const Defines& defines) {
  const bool single = precision == Precision::Single;
  if (std::string fault = memory_fault(device); !fault.empty()) return fault;
  std::string fault = single ? product_fault<float>(device, defines) : product_fault<double>(device, defines);
  if (!fault.empty()) return fault;
  return single ? function_fault<float>(device, defines) : function_fault<double>(device, defines);
}

std::string remembered_probe_fault(Device& device, Precision precision) {
  const DiskCache cache;
  const char* kind = precision == Precision::Single ? "probe" : "probe-double";
  const std::string key = device.fingerprint() + driver_environment() + "\n" + kernel_source(file);
  if (const auto verdict = cache.load(kind, key)) return *verdict;
  std::string fault;
  try {
    fault = probe_fault(device, precision);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::Device) throw;
    return error.what();
  }
  cache.store(kind, key, fault);
  return fault;
}

}  // namespace clerestory
