#include "tests/ops/shade/surface_probe.hpp"

#include <algorithm>

namespace clerestory {

Buffer Probe::upload(const std::vector<double>& values) {
  const Buffer buffer = device_.allocate(values.size() * real_size(precision_));
  if (precision_ == Precision::Double) {
    device_.write(buffer, values.data(), values.size() * sizeof(double));
  } else {
    const std::vector<float> floats(values.begin(), values.end());
    device_.write(buffer, floats.data(), floats.size() * sizeof(float));
    device_.finish();
  }
  return buffer;
}

std::vector<double> Probe::download(const Buffer& buffer, std::size_t count) {
  std::vector<double> values(count);
  if (precision_ == Precision::Double) {
    device_.read(buffer, values.data(), count * sizeof(double));
    return values;
  }
  std::vector<float> floats(count);
  device_.read(buffer, floats.data(), count * sizeof(float));
  std::copy(floats.begin(), floats.end(), values.begin());
  return values;
}

}  // namespace clerestory
