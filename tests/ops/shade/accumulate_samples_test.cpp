// Means and statistics over the samples of a pixel, against sums in double; what is dropped, what is not there.
#include "host/ops/shade/accumulate_samples.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

constexpr int kPixels = 5, kSamples = 48, kCount = 60;

Tensors sums_inputs() {
  Tensors t{{"weight", random_tensor({1, 3, kPixels, kSamples}, 1, 0, 2)},
            {"radiance", random_tensor({1, 3, kPixels, kSamples}, 2, 0, 5)},
            {"pdf", random_tensor({1, 1, kPixels, kSamples}, 3, 0.1, 2)},
            {"u", random_tensor({1, 1, kPixels, kSamples}, 4, 0, 1)},
            {"hit", random_ints({1, 1, kPixels, kSamples}, 5, -1, 3)}};
  for (int s = 0; s < kSamples; s += 7) t["pdf"].at(0, 0, 2, s) = 0;
  return t;
}

std::vector<Tensor> sums_reference(const Tensors& t, bool traced) {
  Tensor mean(Shape{1, 3, kPixels, 1}), squares = mean, tally(Shape{1, 4, kPixels, 1}), first(Shape{1, 1, kPixels, 1});
  for (int p = 0; p < kPixels; ++p) {
    for (int c = 0; c < 3; ++c) {
      const auto x = [&](int s) {
        return t.at("pdf").at(0, 0, p, s) == 0 ? 0.0 : t.at("weight").at(0, c, p, s) * t.at("radiance").at(0, c, p, s);
      };
      double sum = 0;
      for (int s = 0; s < kSamples; ++s) sum += x(s);
      for (int s = 0; s < kSamples; ++s) squares.at(0, c, p, 0) += std::pow(x(s) - sum / kSamples, 2);
      mean.at(0, c, p, 0) = sum / kCount;
    }
    for (int s = 0; s < kSamples; ++s) {
      if (t.at("pdf").at(0, 0, p, s) == 0) continue;
      tally.at(0, 1, p, 0) += 1;
      if (!traced) continue;
      tally.at(0, 0, p, 0) += t.at("u").at(0, 0, p, s);
      tally.at(0, 3, p, 0) += t.at("hit").integer[static_cast<std::size_t>(p * kSamples + s)] >= 0;
    }
  }
  return {mean, squares, tally, first};
}

OP_CASES(accumulate_samples) {
  std::vector<OpCase> cases;
  for (const bool traced : {false, true}) {
    OpCase c{.stem = "accumulate_samples",
             .label = traced ? "traced" : "untraced",
             .kernels = {"accumulate_samples"},
             .inputs = sums_inputs()};
    c.build = [traced](Graph&, const Values& v) {
      const SampleSums s = accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"),
                                              traced ? v.at("u") : Value{}, traced ? v.at("hit") : Value{}, kCount);
      return std::vector<Value>{s.mean, s.squares, s.tally, s.first};
    };
    c.reference = [traced](const Tensors& t) { return sums_reference(t, traced); };
    c.roundings = 12;  // three terms a lane, compensated, and a tree of sixteen; squares double the error of x
    c.no_gradient = "squares and tally are statistics; the mean has a case of its own";
    cases.push_back(c);
  }
  OpCase mean = cases.front();
  mean.label = "mean";
  mean.kernels = {"accumulate_samples", "accumulate_samples_adjoint"};
  mean.build = [](Graph&, const Values& v) {
    return std::vector{accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"), {}, {}, kCount).mean};
  };
  mean.reference = [](const Tensors& t) { return std::vector{sums_reference(t, false)[0]}; };
  mean.no_gradient = {}, mean.differentiate = {"weight", "radiance"};
  mean.step = 1e-2, mean.gradient_tolerance = 1e-10;  // bilinear: a difference is exact but for rounding
  cases.push_back(mean);
  OpCase finish{.stem = "accumulate_samples", .label = "finish", .kernels = {"finish_samples"}};
  finish.inputs = {{"squares", random_tensor({2, 3, 4, 5}, 6, 0, 9)}, {"tally", random_tensor({2, 4, 4, 5}, 7, 5, 6)}};
  for (int n = 0; n < 2; ++n)
    finish.inputs["tally"].at(n, 1, 0, 0) = finish.inputs["tally"].at(n, 2, 0, 0);  // nothing left
  finish.build = [](Graph&, const Values& v) {
    const SampleStatistics s = finish_samples(v.at("squares"), v.at("tally"), 64, 2);
    return std::vector<Value>{s.standard_error, s.uncertainty};
  };
  finish.reference = [](const Tensors& t) {
    Tensor error(Shape{2, 3, 4, 5}), u(Shape{2, 1, 4, 5});
    for (int n = 0; n < 2; ++n)
      for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x) {
          for (int c = 0; c < 3; ++c) error.at(n, c, y, x) = std::sqrt(t.at("squares").at(n, c, y, x) / 62 / 64);
          const double used = t.at("tally").at(n, 1, y, x) - t.at("tally").at(n, 2, y, x);
          u.at(n, 0, y, x) = used > 0 ? t.at("tally").at(n, 0, y, x) / used : 0;
        }
    return std::vector<Tensor>{error, u};
  };
  // used is a difference of near numbers; but it is the same in float, whose inputs are rounded before.
  finish.roundings = 64;
  finish.no_gradient = "a statistic";
  cases.push_back(finish);
  return cases;
}

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
            const double share = kept ? g.at(0, c, p, 0) / kCount : 0;
            const double d_weight = kept ? share * t["radiance"].at(0, c, p, s) : 0;
            const double d_radiance = kept ? share * t["weight"].at(0, c, p, s) : 0;
            ASSERT_NEAR(got[0].at(0, c, p, s), d_weight, 3e-7 * std::abs(d_weight)) << name << " " << p << " " << s;
            ASSERT_NEAR(got[1].at(0, c, p, s), d_radiance, 3e-7 * std::abs(d_radiance)) << name << " " << p << " " << s;
          }
      Tensors without = t;  // the sample as if it were not there, but for what counts it
      without["pdf"].at(0, 0, 3, at) = 0;
      for (int c = 0; c < 3; ++c) without["weight"].at(0, c, 3, at) = without["radiance"].at(0, c, 3, at) = 0;
      std::vector<Tensor> want = sums_reference(without, true);
      want[2].at(0, 1, 3, 0) += 1, want[2].at(0, 2, 3, 0) = 1, want[3].at(0, 0, 3, 0) = at + 1;
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < want[k].real.size(); ++i)
          ASSERT_NEAR(got[2 + k].real[i], want[k].real[i], 2e-6 * std::max(1.0, want[k].real[i]))
              << name << ", output " << k << " element " << i;
    }
}

}  // namespace
}  // namespace clerestory
