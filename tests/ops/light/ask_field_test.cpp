// The radiance field in one kernel, beside the ops that it puts together.
#include "host/ops/light/ask_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "checks/light/ask_field_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/net.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

using namespace ask_field_reference;

/// Against the same steps through memory: a product may or may not be fused with the sum after it.
Uncertain against_composed(const Field& f) { return {0.5 * f.options.march.radius, 0}; }

/// The same light through memory.
Value composed(const Field& f, const Values& v) {
  const Marched samples =
      march(v.at("points"), v.at("direction"), v.at("range"), v.at("direction").shape(), f.options.march);
  Tensor frequencies = octave_frequencies(3, f.options.octaves);
  for (double& x : frequencies.real) x /= std::numbers::pi;
  const Value x = samples.position;
  Value y = concat(std::array{x, encode(x, x.graph().constant(frequencies))});
  for (std::size_t i = 0; i < f.layers(); ++i) {
    y = conv(y, v.at(weight_name(i)), v.at(bias_name(i)));
    if (i + 1 < f.layers() || f.options.released_output) y = relu(y);
  }
  if (!f.options.released_output) y = activate(y, Function::Softplus);
  const Composited seen = composite(slice(y, 3, 1), slice(y, 0, 3), samples.length);
  if (!f.background) return seen.radiance;
  return add(seen.radiance, conv(seen.transmittance, reshape(v.at("background"), {3, 1, 1, 1}), {}));
}

/// A graph of inputs that is run on chunks of them.
void expect_composed(const Field& f) {
  const Tensors inputs = field_inputs(f, 5, 48);
  Net net(inputs);
  const std::vector<Value> both{ask(f, net.values, {}), composed(f, net.values)};
  // Of points in the middles of their pieces; jitter moves them, but the field is as rough everywhere.
  const double roundings = plain_answer(f, inputs, {}, against_composed(f)).roundings;
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const std::vector<Tensor> got = net.run(both, inputs, precision);
    const double epsilon = precision == Precision::Single ? 0x1p-23 : 0x1p-52;
    double worst = 0, largest = 0;
    for (std::size_t i = 0; i < got[0].real.size(); ++i) {
      worst = worse(worst, std::abs(got[0].real[i] - got[1].real[i]));
      largest = std::max(largest, std::abs(got[1].real[i]));
    }
    EXPECT_GT(largest, 0.1);
    // What the fused kernel leaves out behind an optical depth of 14.
    EXPECT_LE(worst, roundings * epsilon + std::exp(-kOpaque) * largest) << "of " << largest;
  }
}

TEST(AskField, IsMarchEncodeConvAndComposite) {
  for (const bool jitter : {false, true})
    for (const bool released : {false, true}) {
      Field f;
      f.options.march.jitter = jitter, f.options.march.segments = 9, f.options.released_output = released;
      f.background = jitter == released;
      expect_composed(f);
    }
}

/// How far softplus is off as the field computes it: the mean error relative to ln(1 + e^-|x|), which keeps what the
/// series leaves out, always of one sign, and hardly anything of rounding to nearest; and the largest relative to the
/// value. A solid field of one layer shows its colour, and that is softplus of a position's coordinate.
struct SoftplusError {
  double mean = 0, largest = 0;
};

SoftplusError softplus_error(double low, double high, Precision precision) {
  constexpr int rows = 64, samples = 64, count = rows * samples;
  Field f{.hidden = {}};
  f.options.released_output = false, f.options.octaves = 1, f.options.march.segments = 1;
  f.options.march.near = 0, f.options.march.radius = 1000;
  Tensors t = field_inputs(f, rows, samples);
  t["range"].real[0] = 1;
  t["w0"] = Tensor(t["w0"].shape), t["b0"] = Tensor(t["b0"].shape);
  t["w0"].at(0, 0, 0, 0) = 1;    // red = softplus(x)
  t["b0"].at(0, 3, 0, 0) = 1e6;  // solid from the start
  t["points"] = t["direction"] = Tensor({1, 3, rows, samples});
  for (int i = 0; i < count; ++i) {
    t["points"].at(0, 0, i / samples, i % samples) = static_cast<float>(low + (high - low) * (i + 0.5) / count);
    t["direction"].at(0, 2, i / samples, i % samples) = -1;  // x stays what it is
  }
  Net net(t);
  const Tensor got = net.run({ask(f, net.values, {})}, t, precision)[0];
  SoftplusError error;
  for (int i = 0; i < count; ++i) {
    const long double x = t["points"].at(0, 0, i / samples, i % samples), part = std::log1p(std::exp(-std::abs(x)));
    const long double want = std::max(x, 0.0L) + part, off = got.at(0, 0, i / samples, i % samples) - want;
    error.mean += static_cast<double>(off / part) / count;
    error.largest = std::max(error.largest, static_cast<double>(std::abs(off / want)));
  }
  return error;
}

// kernels/light/ask_field.cl states what its series leaves out, 1.6e-8 in float and 2e-17 in double. A mean of 4096
// errors of at most half an epsilon each has four deviations of 2 / 64 of an epsilon. A single value is rounded by exp
// (3 ulp, as OpenCL has it), a division (2.5) and some five sums and products.
TEST(AskField, SoftplusIsAsGoodAsItSays) {
  const std::vector<std::pair<double, double>> ranges{{-80, -10}, {-10, -1}, {-1, -0.1}, {-0.1, 0},
                                                      {0, 0.1},   {0.1, 1},  {1, 10},    {10, 100}};
  for (const auto& [precision, epsilon, left_out] :
       {std::tuple{Precision::Single, 0x1p-23, 1.6e-8}, {Precision::Double, 0x1p-52, 2e-17}})
    for (const auto& [low, high] : ranges) {
      const SoftplusError error = softplus_error(low, high, precision);
      EXPECT_LE(error.largest, left_out + 8 * epsilon) << low << " to " << high;
      if (high > 0) continue;  // the sum with x is rounded at its size
      EXPECT_LE(std::abs(error.mean), left_out + 2 * epsilon / 64) << low << " to " << high;
    }
}

// Octaves by doubling angles: two steps from one that is computed, which leaves at most 8.9 epsilons of 0.75
// (kernels/light/ask_field.cl). Beside them the angle, of at most 3 here, is rounded twice as turns: an epsilon of it
// each, and 1.5 in the end of the sum with 1, which keeps colours positive.
TEST(AskField, EveryOctaveKeepsItsDigits) {
  constexpr int rows = 16, samples = 64, octaves = 10;
  Field f{.hidden = {}};
  f.options.octaves = octaves, f.options.march.segments = 1, f.options.march.near = 0, f.options.march.radius = 1000;
  for (int k = 0; k < octaves; ++k) {
    Tensors t = field_inputs(f, rows, samples);
    t["range"].real[0] = 1;
    t["w0"] = Tensor(t["w0"].shape), t["b0"] = Tensor(t["b0"].shape);
    for (int c = 0; c < 2; ++c) {  // red = 1 + sin(2^k x), green = 1 + cos(2^k x)
      t["w0"].at(c, 3 + 3 * c * octaves + k, 0, 0) = 1;
      t["b0"].at(0, c, 0, 0) = 1;
    }
    t["b0"].at(0, 3, 0, 0) = 1e6;  // solid from the start
    t["points"] = t["direction"] = Tensor({1, 3, rows, samples});
    for (int i = 0; i < rows * samples; ++i) {
      t["points"].at(0, 0, i / samples, i % samples) =
          static_cast<float>(std::ldexp(3.0 * (2 * i + 1 - rows * samples) / (rows * samples), -k));
      t["direction"].at(0, 2, i / samples, i % samples) = -1;
    }
    Net net(t);
    const Tensor got = net.run({ask(f, net.values, {})}, t, Precision::Single)[0];
    for (int i = 0; i < rows * samples; ++i) {
      const double angle = std::ldexp(t["points"].at(0, 0, i / samples, i % samples), k);
      ASSERT_NEAR(got.at(0, 0, i / samples, i % samples), 1 + std::sin(angle), 17 * 0x1p-23) << "octave " << k;
      ASSERT_NEAR(got.at(0, 1, i / samples, i % samples), 1 + std::cos(angle), 17 * 0x1p-23) << "octave " << k;
    }
  }
}

// Any list and any tile: the same bits for a ray.
TEST(AskField, ARayIsAskedAlone) {
  Field f;
  f.options.march.jitter = true, f.options.released_output = false, f.density_bias = 6, f.background = true;
  const Tensors inputs = field_inputs(f, 6, 32);
  Net net(inputs);
  const Tensor all = net.run({ask(f, net.values, {})}, inputs, Precision::Single)[0];
  const std::vector<int> list = every(5, 192);
  const Tensor some =
      net.run({ask(f, net.values, list_of(net.graph, list, {1, 1, 6, 32}))}, inputs, Precision::Single)[0];
  for (int i = 0; i < 192; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(some.at(0, c, i / 32, i % 32), i % 5 == 1 ? all.at(0, c, i / 32, i % 32) : 0);

  const Tensors part = tile_of(inputs);
  Net tile(part);
  const Value listed = ask(f, tile.values, list_of(tile.graph, {3, 40, 63}, {1, 1, 5, 16}));
  const std::vector<Tensor> got = tile.run({ask(f, tile.values, {}), listed}, part, Precision::Single, {2, 4, 16, 16});
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 5; ++p)
      for (int s = 0; s < 16; ++s) {
        const double want = p < 4 ? all.at(0, c, p + 2, s + 16) : 0;
        const int ray = 16 * p + s;
        EXPECT_EQ(got[0].at(0, c, p, s), want);
        EXPECT_EQ(got[1].at(0, c, p, s), ray == 3 || ray == 40 || ray == 63 ? want : 0);
      }
}

TEST(AskField, AnEmptyListGivesZeros) {
  const Field f;
  const Tensors inputs = field_inputs(f, 3, 16);
  Net net(inputs);
  const Tensor y = net.run({ask(f, net.values, list_of(net.graph, {}, {1, 1, 3, 16}))}, inputs, Precision::Single)[0];
  EXPECT_EQ(y.real, Tensor(y.shape).real);
}

TEST(AskField, ArgumentsAreChecked) {
  const Field f;
  Net net(field_inputs(f, 2, 16));
  const auto change = [&](const char* name, const Shape& shape) {
    Values changed = net.values;
    changed[name] = net.graph.fill(shape, 0);
    return changed;
  };
  EXPECT_NO_THROW(ask(f, net.values, {}));
  EXPECT_THROW(ask(f, change("points", {1, 3, 3, 16}), {}), Error);
  EXPECT_THROW(ask(f, change("range", {2, 3, 1, 1}), {}), Error);
  EXPECT_THROW(ask(f, change("w1", {32, 31, 1, 1}), {}), Error);
  EXPECT_THROW(ask(f, change("w2", {3, 32, 1, 1}), {}), Error);
  EXPECT_THROW(ask(f, change("b0", {1, 31, 1, 1}), {}), Error);
  EXPECT_THROW(ask(f, net.values, list_of(net.graph, {}, {1, 1, 3, 16})), Error);
  Field behind = f;
  behind.background = true;
  EXPECT_THROW(ask(behind, change("background", {1, 1, 1, 1}), {}), Error);
  Field wide = f;
  wide.options.octaves = 11;
  EXPECT_THROW(ask(wide, net.values, {}), Error);
  const Value y = ask(f, net.values, {});
  EXPECT_THROW(gradient(std::vector{y}, std::vector{net.graph.fill(y.shape(), 1)}, std::vector{net.values.at("w0")}),
               Error);
}

}  // namespace
}  // namespace clerestory
