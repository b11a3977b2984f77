// Means and statistics over the samples of a pixel: what is dropped, what is not there, how many there may be.
#include "host/ops/shade/accumulate_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/accumulate_samples_reference.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

using namespace accumulate_samples_reference;

// What lies beyond the samples of a chunk counts for nothing and has no gradient, even where it looks like rays; any
// count, that is, any rest of a vector.
TEST(AccumulateSamples, SamplesBeyondTheChunkAreNotThere) {
  Graph g;
  Values v;
  const Tensors all = sums_inputs();
  for (const auto& [name, tensor] : all) v[name] = g.input(name, tensor.shape, tensor.type());
  const SampleSums s = accumulate_samples(v["weight"], v["radiance"], v["pdf"], v["u"], v["hit"], kCount);
  const Value d_mean = g.constant(random_tensor({1, 3, kPixels, 1}, 9));
  std::vector<Value> outputs =
      gradient(std::vector{s.mean}, std::vector{d_mean}, std::vector{v["weight"], v["radiance"]});
  outputs.insert(outputs.end(), {s.mean, s.squares, s.tally, s.first});
  Executor executor(compile(g, outputs, test_device()));
  for (int count = 1; count < kSamples; ++count) {
    Tensors garbage = all, nothing = all;
    for (int p = 0; p < kPixels; ++p)
      for (int k = count; k < kSamples; ++k) {
        nothing["pdf"].at(0, 0, p, k) = 0;
        for (int c = 0; c < 3; ++c) garbage["radiance"].at(0, c, p, k) = k == count ? 1e3 : NAN;
      }
    std::vector<std::vector<double>> got[2];
    for (const int which : {0, 1}) {
      for (const auto& [name, tensor] : which == 0 ? garbage : nothing) executor.feed(name, tensor);
      executor.run(0, {0, kPixels, 0, count});
      for (const Value& output : outputs) got[which].push_back(executor.fetch(output).real);
    }
    ASSERT_EQ(got[0], got[1]) << count << " samples";
  }
}

// A ray without a direction is not a dropped sample, whatever stands there: the first that is one is named.
TEST(AccumulateSamples, OnlyDirectionsAreDropped) {
  Tensors t = sums_inputs();  // pixel 2 has no direction at samples 0, 7, ...
  t["radiance"].at(0, 1, 2, 0) = NAN, t["radiance"].at(0, 1, 2, 10) = INFINITY;
  Graph g;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = g.constant(tensor);
  const SampleSums s = accumulate_samples(v["weight"], v["radiance"], v["pdf"], v["u"], v["hit"], kCount);
  const std::vector<Tensor> got = evaluate(g, {s.tally, s.first}, test_device(), {});
  for (int p = 0; p < kPixels; ++p) {
    EXPECT_EQ(got[0].at(0, 2, p, 0), p == 2);
    EXPECT_EQ(got[1].at(0, 0, p, 0), p == 2 ? 11 : 0);
  }
}

// A quarter of a million samples of one pixel: lanes are summed with Kahan's compensation, which leaves two roundings
// of each whatever their length; then a tree of sixteen, a product and a division. Summed one by one the same number's
// rounding errors would add up to a thousandth.
TEST(AccumulateSamples, ManySamplesKeepTheirDigits) {
  constexpr int samples = 1 << 18;
  constexpr Shape rays{1, 3, 1, samples}, one{1, 1, 1, samples};
  Graph g;
  const Value mean = accumulate_samples(g.fill(rays, 1), g.fill(rays, 0.1), g.fill(one, 1), {}, {}, samples).mean;
  const Tensor got = evaluate(g, {mean}, test_device(), {})[0];
  for (const double x : got.real) EXPECT_NEAR(x, 0.1, (2 + 4 * 0.5 + 0.5 + 0.5 + 0.5) * 0x1p-23 * 0.1);
}

// One sample that is no number, in whichever factor and channel, or that overflows as a product: it is dropped whole,
// it has no gradient, and those of all other samples are right.
TEST(AccumulateSamples, ADroppedSampleLeavesTheGradientsOfAllOthers) {
  struct Offence {
    const char* name;
    double weight, radiance;
  };
  const double inf = INFINITY;
  for (const auto& [name, weight, radiance] : {Offence{"radiance inf", 1, inf},
                                               {"radiance nan", 1, NAN},
                                               {"weight inf", inf, 1},
                                               {"weight nan", NAN, 1},
                                               {"zero times inf", 0, inf},
                                               {"overflow", 1e30, 1e30}})
    for (int channel = 0; channel < 3; ++channel) {
      const int at = 5 + channel;
      Tensors t = sums_inputs();
      t["weight"].at(0, channel, 3, at) = weight, t["radiance"].at(0, channel, 3, at) = radiance;
      Graph graph;
      Values v;
      for (const auto& [input, tensor] : t) v[input] = graph.input(input, tensor.shape, tensor.type());
      const SampleSums sums = accumulate_samples(v["weight"], v["radiance"], v["pdf"], v["u"], v["hit"], kCount);
      const Tensor g = random_tensor({1, 3, kPixels, 1}, 9);
      std::vector<Value> outputs =
          gradient(std::vector{sums.mean}, std::vector{graph.constant(g)}, std::vector{v["weight"], v["radiance"]});
      outputs.insert(outputs.end(), {sums.mean, sums.squares, sums.tally, sums.first});
      const std::vector<Tensor> got = evaluate(graph, outputs, test_device(), t);
      // The mean is bilinear: its derivative by a factor is the other one's share, as differences say of `mean`'s case.
      for (int p = 0; p < kPixels; ++p)
        for (int s = 0; s < kSamples; ++s)
          for (int c = 0; c < 3; ++c) {
            const bool kept = t["pdf"].at(0, 0, p, s) != 0 && !(p == 3 && s == at);
            // Rounded: what comes back, its share, the other factor, and their product.
            const double share = kept ? g.at(0, c, p, 0) / kCount : 0;
            const double d_weight = kept ? share * t["radiance"].at(0, c, p, s) : 0;
            const double d_radiance = kept ? share * t["weight"].at(0, c, p, s) : 0;
            ASSERT_NEAR(got[0].at(0, c, p, s), d_weight, 4 * kFloatRounding * std::abs(d_weight))
                << name << " " << p << " " << s;
            ASSERT_NEAR(got[1].at(0, c, p, s), d_radiance, 4 * kFloatRounding * std::abs(d_radiance))
                << name << " " << p << " " << s;
          }
      Tensors without = t;  // the sample as if it were not there, but for what counts it
      without["pdf"].at(0, 0, 3, at) = 0;
      for (int c = 0; c < 3; ++c) without["weight"].at(0, c, 3, at) = without["radiance"].at(0, c, 3, at) = 0;
      std::vector<Tensor> want = sums_reference(without, true);
      want[2].at(0, 1, 3, 0) += 1, want[2].at(0, 2, 3, 0) = 1, want[3].at(0, 0, 3, 0) = at + 1;
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < want[k].real.size(); ++i)  // as many roundings as the case of the op counts
          ASSERT_NEAR(got[2 + k].real[i], want[k].real[i], 12 * 2 * kFloatRounding * std::max(1.0, want[k].real[i]))
              << name << ", output " << k << " element " << i;
    }
}

}  // namespace
}  // namespace clerestory
