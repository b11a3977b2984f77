// Gradients of the layer in batches: what they state of their error is the error that they have.
#include "nets/timed_layer.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "tests/nets/corner.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr int kSeeds = 48, kBatches = 8;

/// Over seeds, of each value: the variance that is seen, and the mean of that which is stated.
struct Variances {
  std::vector<std::vector<double>> runs;
  std::vector<double> stated;

  void add(const std::vector<double>& values, const std::vector<double>& errors) {
    runs.resize(values.size()), stated.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      runs[i].push_back(values[i]), stated[i] += errors[i] * errors[i] / kSeeds;
  }
  /// Stated over seen. `middle`: the median of pixels in place of all together, in which the noisiest count most.
  double ratio(bool middle) const {
    std::vector<double> ratios;
    double seen = 0, said = 0;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const double variance = std::pow(standard_deviation(runs[i]), 2);
      seen += variance, said += stated[i];
      if (variance > 0) ratios.push_back(stated[i] / variance);
    }
    return middle ? median(ratios) : said / seen;
  }
};

class Batches : public testing::TestWithParam<const char*> {};

TEST_P(Batches, StateTheSpreadOverSeedsOfEveryGradient) {
  const Scene scene = corner();
  RenderSettings settings;
  settings.spp = 64, settings.points = GetParam();
  TimedLayer layer(device_for(Precision::Single), scene, settings, LayerResult::TwoDraws, Precision::Single, kBatches);
  std::map<std::string, Variances> found;
  for (int s = 0; s < kSeeds; ++s) {
    layer.run(static_cast<std::uint32_t>(s));
    const auto values = layer.values(), errors = layer.standard_errors();
    for (const auto& [name, v] : values) found[name].add(v, errors.at(name));
  }
  ASSERT_EQ(found.size(), 5u);
  for (const auto& [name, variances] : found) {
    // A thousand pixels' variances of 48 values, which by themselves are good to 20 %, all together to some 3 %, less
    // where few pixels make most of the sum; the median of a ratio of two that are skewed lies near 1, not at it.
    EXPECT_NEAR(variances.ratio(false), 1, 0.15) << name;
    EXPECT_NEAR(variances.ratio(true), 1, 0.15) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(TimedLayer, Batches, testing::Values("sobol", "independent"),
                         [](const auto& points) { return points.param; });

TEST(TimedLayer, BatchesAreEqualPartsAndOneHasNoSpread) {
  const Scene scene = corner();
  RenderSettings settings;
  settings.spp = 20;
  const Device device = device_for(Precision::Single);
  EXPECT_THROW(TimedLayer(device, scene, settings, LayerResult::TwoDraws, Precision::Single, 8), Error);
  TimedLayer whole(device, scene, settings, LayerResult::Picture),
      parts(device, scene, settings, LayerResult::Picture, Precision::Single, 4);
  whole.run(1), parts.run(1);
  EXPECT_THROW(whole.standard_errors(), Error);
  // The mean of four pictures of five samples each, by the seeds that they have.
  settings.spp = 5;
  TimedLayer few(device, scene, settings, LayerResult::Picture);
  std::vector<double> sum(parts.values().at("picture").size(), 0);
  for (std::uint32_t k = 0; k < 4; ++k) {
    few.run(4 + k);
    const std::vector<double> one = few.values().at("picture");
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += one[i] / 4;
  }
  for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_NEAR(parts.values().at("picture")[i], sum[i], 1e-12 * sum[i]);
}

TEST(TimedLayer, TracesTheRaysOfOneDrawOnce) {
  const Scene scene = corner();
  RenderSettings settings;
  settings.spp = 16;
  const Device device = device_for(Precision::Single);
  const auto traces = [&](LayerResult result) { return TimedLayer(device, scene, settings, result).traces(); };
  EXPECT_EQ(traces(LayerResult::Picture), 1);
  EXPECT_EQ(traces(LayerResult::OneDraw), 1);
  EXPECT_EQ(traces(LayerResult::TwoDraws), 2);
}

}  // namespace
}  // namespace clerestory
