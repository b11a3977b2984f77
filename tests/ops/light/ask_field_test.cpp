// The radiance field in one kernel: against plain double arithmetic and against the ops that it puts together.
#include "host/ops/light/ask_field.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/ops/light/composite.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/listed_rays.hpp"

namespace clerestory {
namespace {

constexpr double kOpaque = 14;

struct Field {
  std::vector<int> hidden = {32, 32};
  FieldOptions options{.march = {.segments = 6, .near = 0.05, .radius = 3, .jitter = false}};
  double density_bias = 0, density_gain = 1;
  bool background = false;

  std::vector<int> widths() const {
    std::vector<int> w{3 + 6 * options.octaves};
    w.insert(w.end(), hidden.begin(), hidden.end());
    w.push_back(4);
    return w;
  }
  std::size_t layers() const { return hidden.size() + 1; }
};

std::string weight_name(std::size_t i) { return fmt::format("w{}", i); }
std::string bias_name(std::size_t i) { return fmt::format("b{}", i); }

/// Weights as large as a net's, points in a room of a few metres, directions of any length.
Tensors field_inputs(const Field& f, int rows, int samples, bool point_per_row = false) {
  Tensors t{{"points", random_tensor({1, 3, rows, point_per_row ? 1 : samples}, 1, -2, 2)},
            {"direction", random_tensor({1, 3, rows, samples}, 2)},
            {"range", Tensor(Shape{1, 3, 1, 1}, std::vector<double>{2.5, 1, 3})}};
  const std::vector<int> widths = f.widths();
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    const double size = std::sqrt(6.0 / widths[i]);
    t[weight_name(i)] = random_tensor({widths[i + 1], widths[i], 1, 1}, 10 + i, -size, size);
    t[bias_name(i)] = random_tensor({1, widths[i + 1], 1, 1}, 30 + i, -0.2, 0.5);
  }
  if (f.background) t["background"] = random_tensor({1, 3, 1, 1}, 50, 0.5, 2);
  for (int k = 0; k < widths[f.layers() - 1]; ++k) t[weight_name(f.layers() - 1)].at(3, k, 0, 0) *= f.density_gain;
  t[bias_name(f.layers() - 1)].at(0, 3, 0, 0) += f.density_bias;
  return t;
}

/// A number and the deviation of its rounding errors, in epsilons: errors of single operations are as good as
/// independent, so their squares add up (Higham and Mary 2019, SIAM J. Sci. Comput. 41(5)). Bounds are kDeviations of
/// them.
struct Rounded {
  double value = 0, deviation = 0;
};
constexpr double kDeviations = 4;

double root_of_squares(double a, double b) { return std::sqrt(a * a + b * b); }

/// What is uncertain before any sum: positions, in epsilons, and how much of an octave's angle 2^k x is rounded anew.
struct Uncertain {
  double position = 0, angle = 0;
};
/// Against exact arithmetic: start, direction and distance of a point are each rounded at the size of the sphere.
Uncertain against_exact(const Field& f) { return {4 * f.options.march.radius, 1}; }
/// Against the same steps through memory: a product may or may not be fused with the sum after it.
Uncertain against_composed(const Field& f) { return {0.5 * f.options.march.radius, 0}; }

/// Density and colour at a position. Each step of a sum is rounded to half an epsilon of what there is so far; sines
/// and cosines have up to 9 (kernels/light/ask_field.cl).
std::vector<Rounded> field_at(const Field& f, const Tensors& t, const double position[3], const Uncertain& u) {
  std::vector<Rounded> x;
  for (int c = 0; c < 3; ++c) x.push_back({position[c], u.position});
  for (const bool cosine : {false, true})
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < f.options.octaves; ++k) {
        const double factor = std::ldexp(1.0, k), angle = factor * position[c];
        x.push_back({cosine ? std::cos(angle) : std::sin(angle),
                     root_of_squares(factor * u.position, u.angle * std::abs(angle) + 9)});
      }
  for (std::size_t i = 0; i < f.layers(); ++i) {
    const Tensor &w = t.at(weight_name(i)), &b = t.at(bias_name(i));
    std::vector<Rounded> y(static_cast<std::size_t>(w.shape.n));
    for (int m = 0; m < w.shape.n; ++m) {
      Rounded sum;
      const auto add = [&](double term, double deviation) {
        sum.value += term;
        sum.deviation = root_of_squares(sum.deviation, root_of_squares(deviation, 0.5 * sum.value));
      };
      for (int k = 0; k < w.shape.c; ++k) {
        const Rounded& from = x[static_cast<std::size_t>(k)];
        const double weight = w.at(m, k, 0, 0);
        add(weight * from.value, weight * from.deviation);
      }
      add(b.at(0, m, 0, 0), 0);
      const bool soft = i + 1 == f.layers() && !f.options.released_output;
      const double value = std::max(sum.value, 0.0) + (soft ? std::log1p(std::exp(-std::abs(sum.value))) : 0);
      y[static_cast<std::size_t>(m)] = {value, root_of_squares(sum.deviation, 4 * value)};
    }
    x = y;
  }
  return x;
}

/// What one ray brings, composited with the segments behind kOpaque left out. A share has the error of its colour and
/// of the exponential's argument; an optical depth's moves the light of all segments behind it, seen through T_{k+1}.
std::array<Rounded, 3> light_of_ray(const Field& f, const Tensors& t, int row, int sample, const Uncertain& u) {
  const Tensor &points = t.at("points"), &directions = t.at("direction");
  const MarchOptions& march = f.options.march;
  const double scale = t.at("range").real[0];
  double p[3], d[3], size = 0, along = 0, distance = 0;
  for (int c = 0; c < 3; ++c) {
    p[c] = points.at(0, c, row, points.shape.w == 1 ? 0 : sample) / scale;
    d[c] = directions.at(0, c, row, sample), size += d[c] * d[c];
  }
  for (int c = 0; c < 3; ++c) d[c] /= std::sqrt(size), along += p[c] * d[c], distance += p[c] * p[c];
  // All cases start inside of the sphere.
  const double exit = -along + std::sqrt(along * along - distance + march.radius * march.radius);
  const double far = std::max(exit, march.near), piece = (far - march.near) / march.segments;
  std::array<Rounded, 3> sum{};
  double depth = 0, brightest = f.background ? 2 : 0;
  for (int k = 0; k < march.segments && depth < kOpaque; ++k) {
    double at[3];
    for (int c = 0; c < 3; ++c) at[c] = p[c] + (march.near + (k + 0.5) * piece) * d[c];
    const std::vector<Rounded> y = field_at(f, t, at, u);
    const double length = k + 1 < march.segments ? piece : piece / 2, thickness = y[3].value * length;
    const double share = std::exp(-depth) * -std::expm1(-thickness);
    for (std::size_t c = 0; c < 3; ++c) {
      brightest = std::max(brightest, y[c].value);
      sum[c].value += share * y[c].value;
      sum[c].deviation =
          root_of_squares(sum[c].deviation, share * root_of_squares(y[c].deviation, y[c].value * (4 + depth)));
    }
    depth += thickness;
    const double moved = root_of_squares(y[3].deviation * length, u.position * y[3].value) + 2 * thickness;
    for (Rounded& channel : sum)
      channel.deviation = root_of_squares(channel.deviation, brightest * std::exp(-depth) * moved);
  }
  for (int c = 0; c < 3 && f.background; ++c) {
    Rounded& channel = sum[static_cast<std::size_t>(c)];
    const double behind = std::exp(-depth) * t.at("background").at(0, c, 0, 0);
    channel.value += behind, channel.deviation = root_of_squares(channel.deviation, behind * (4 + depth));
  }
  return sum;
}

struct Answer {
  Tensor radiance;
  double roundings = 0;  // how far rounding may take the ray that it harms most, in epsilons
};

/// `list` empty: all rays.
Answer plain_answer(const Field& f, const Tensors& t, const std::vector<int>& list, const Uncertain& u) {
  const Shape& rays = t.at("direction").shape;
  Answer answer{Tensor(Shape{1, 3, rays.h, rays.w}), 0};
  std::vector<int> asked = list;
  if (asked.empty())
    for (int i = 0; i < rays.plane(); ++i) asked.push_back(i);
  for (const int ray : asked) {
    const std::array<Rounded, 3> light = light_of_ray(f, t, ray / rays.w, ray % rays.w, u);
    for (int c = 0; c < 3; ++c) {
      const Rounded& channel = light[static_cast<std::size_t>(c)];
      answer.radiance.at(0, c, ray / rays.w, ray % rays.w) = channel.value;
      answer.roundings = std::max(answer.roundings, kDeviations * channel.deviation);
    }
  }
  return answer;
}

Value ask(const Field& f, const Values& v, const RayList& list) {
  std::vector<Value> weights, biases;
  for (std::size_t i = 0; i < f.layers(); ++i)
    weights.push_back(v.at(weight_name(i))), biases.push_back(v.at(bias_name(i)));
  return ask_field(weights, biases, v.at("points"), v.at("direction"), v.at("range"), list, f.options,
                   f.background ? v.at("background") : Value{});
}

OpCase field_case(const std::string& label, const Field& f, Tensors inputs, const std::vector<int>& list = {}) {
  OpCase c{.stem = "ask_field", .label = label, .kernels = {"pack_layer", "ask_field"}, .inputs = std::move(inputs)};
  const Shape rays = c.inputs.at("direction").shape;
  c.build = [=](Graph& g, const Values& v) {
    return std::vector{ask(f, v, list.empty() ? RayList{} : list_of(g, list, rays))};
  };
  c.reference = [=](const Tensors& t) { return std::vector{plain_answer(f, t, list, against_exact(f)).radiance}; };
  c.roundings = plain_answer(f, c.inputs, list, against_exact(f)).roundings, c.magnitude = 1;
  c.no_gradient = "for inference: throws";
  return c;
}

OP_CASES(ask_field) {
  Field soft;
  soft.options.released_output = false;
  const Field released;
  Field deep{.hidden = {64, 48, 17, 64}};
  deep.options.octaves = 3;
  Field single{.hidden = {}};
  single.options.octaves = 10, single.options.march.segments = 1;
  Field solid = soft, empty;
  solid.density_bias = 1e6;
  empty.density_gain = 0, empty.density_bias = -1;
  Field murky = soft;  // optical depths around the end
  murky.density_bias = 10, murky.options.march.segments = 12;
  Field thin = soft, bare = empty, dense = solid;
  thin.density_bias = -2;
  thin.background = bare.background = dense.background = true;
  return {field_case("softplus", soft, field_inputs(soft, 3, 32)),
          field_case("relu", released, field_inputs(released, 3, 32)),
          field_case("point_per_row", released, field_inputs(released, 5, 16, true)),
          field_case("listed", soft, field_inputs(soft, 7, 16), every(3, 112)),
          field_case("one_ray", soft, field_inputs(soft, 2, 16), {17}),
          field_case("five_layers", deep, field_inputs(deep, 2, 16)),
          field_case("one_layer", single, field_inputs(single, 2, 16)),
          field_case("solid", solid, field_inputs(solid, 2, 16)),
          field_case("empty", empty, field_inputs(empty, 2, 16)),
          field_case("murky", murky, field_inputs(murky, 2, 16)),
          field_case("background", thin, field_inputs(thin, 3, 32), every(2, 96)),
          field_case("background_alone", bare, field_inputs(bare, 2, 16)),
          field_case("background_hidden", dense, field_inputs(dense, 2, 16))};
}

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
      worst = std::max(worst, std::abs(got[0].real[i] - got[1].real[i]));
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
  f.options.march.jitter = true, f.options.released_output = false, f.density_bias = 6;
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
