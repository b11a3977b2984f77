// Weights as the kernels that run a whole net read them: kernels/light/pack_layer.cl alone, by the layout it promises.
#include <gtest/gtest.h>

#include <utility>

#include "host/cl/device.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

constexpr int kPanel = 8, kIn = 3, kAt = 5;
constexpr float kUntouched = -1;

/// A layer of `out` rows of 1, 2, 3, ..., given as columns when `transposed`, biases 100, 101, ..., packed from element
/// kAt on.
std::vector<float> packed(int out, bool has_bias, bool transposed) {
  Device device = test_device();
  std::vector<float> weight(static_cast<std::size_t>(out * kIn)), bias(static_cast<std::size_t>(out));
  for (int m = 0; m < out; ++m)
    for (int k = 0; k < kIn; ++k)
      weight[static_cast<std::size_t>(transposed ? k * out + m : m * kIn + k)] = static_cast<float>(m * kIn + k + 1);
  for (std::size_t i = 0; i < bias.size(); ++i) bias[i] = static_cast<float>(100 + i);
  const int panels = (out + kPanel - 1) / kPanel;
  std::vector<float> result(static_cast<std::size_t>(kAt + panels * (kIn + 1) * kPanel + 1), kUntouched);
  const auto upload = [&](const std::vector<float>& values) {
    const Buffer buffer = device.allocate(values.size() * sizeof(float));
    device.write(buffer, values.data(), buffer.bytes());
    return buffer;
  };
  const Buffer w = upload(weight), b = upload(bias), to = upload(result);
  const std::uint64_t offset = 0;
  device.launch(device.kernel("light/pack_layer.cl", "pack_layer"),
                Range::of2(kIn + 1, static_cast<std::size_t>(panels)), w, offset, transposed ? out : kIn, b, offset,
                out, to, offset, 0, kIn, out, static_cast<int>(has_bias), kAt, static_cast<int>(transposed));
  device.read(to, result.data(), to.bytes());
  return result;
}

TEST(PackLayer, LaysPanelsOfEightOutputsBehindEachOther) {
  for (const int out : {1, 8, 11})
    for (const auto& [has_bias, transposed] : {std::pair{true, false}, {false, false}, {false, true}}) {
      const std::vector<float> found = packed(out, has_bias, transposed);
      for (int i = 0; i < kAt; ++i) EXPECT_EQ(found[static_cast<std::size_t>(i)], kUntouched) << "before the layer";
      EXPECT_EQ(found.back(), kUntouched) << "behind the layer";
      std::size_t at = kAt;
      for (int panel = 0; panel * kPanel < out; ++panel)
        for (int k = 0; k <= kIn; ++k)
          for (int m = panel * kPanel; m < (panel + 1) * kPanel; ++m, ++at) {
            const int bias = has_bias ? 100 + m : 0, value = k < kIn ? m * kIn + k + 1 : bias;
            EXPECT_EQ(found[at], m < out ? value : 0) << "output " << m << " of " << out << ", input " << k;
          }
      EXPECT_EQ(at, found.size() - 1);
    }
}

}  // namespace
}  // namespace clerestory
