// Convolution: exact equality with a plain reference on integers (products and sums of small integers are exact in
// float) over a grid of shapes, for the values and all three gradients, on every set of kernels; finite differences in
// double; both backends in a plan.
#include "host/ops/nn/conv.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv_geometry.hpp"
#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

struct Sizes {
  std::string label;
  Shape x, w;
  int stride = 1, pad = 0;
  int scratch = 0;
  ConvSpec spec(ConvKernels kernels) const { return {stride, pad, kernels, scratch}; }
  Shape y() const { return {x.n, w.n, (x.h + 2 * pad - w.h) / stride + 1, (x.w + 2 * pad - w.w) / stride + 1}; }
};

struct Named {
  std::string name;
  ConvKernels kernels;
  std::vector<std::string> forward, backward;
};

const std::vector<Named>& all_kernels() {
  static const std::vector<Named> all{
      {"cpu", ConvKernels::Cpu, {"conv_pack_weights", "conv_cpu"}, {"conv_weights_cpu", "conv_bias_gradient"}},
      {"gpu", ConvKernels::Gpu, {"conv_pack_weights", "conv_gpu"}, {"conv_weights_gpu", "conv_bias_gradient"}},
      {"clblast", ConvKernels::Clblast, {"conv_fill_bias"}, {"conv_bias_gradient"}}};
  return all;
}

/// Calls visit(y index, x index, w index) for every product of the convolution.
template <class Visit>
void for_products(const Sizes& s, const Visit& visit) {
  const Shape y = s.y();
  for (int n = 0; n < s.x.n; ++n)
    for (int o = 0; o < y.c; ++o)
      for (int i = 0; i < s.x.c; ++i)
        for (int p = 0; p < y.h; ++p)
          for (int q = 0; q < y.w; ++q)
            for (int ky = 0; ky < s.w.h; ++ky)
              for (int kx = 0; kx < s.w.w; ++kx) {
                const int row = p * s.stride + ky - s.pad, column = q * s.stride + kx - s.pad;
                if (row < 0 || row >= s.x.h || column < 0 || column >= s.x.w) continue;
                visit(((n * y.c + o) * y.h + p) * y.w + q, ((n * s.x.c + i) * s.x.h + row) * s.x.w + column,
                      ((o * s.x.c + i) * s.w.h + ky) * s.w.w + kx);
              }
}

Tensor forward(const Sizes& s, const Tensors& in) {
  Tensor y(s.y());
  for (int n = 0; n < y.shape.n; ++n)
    for (int o = 0; o < y.shape.c; ++o)
      for (int p = 0; p < y.shape.h; ++p)
        for (int q = 0; q < y.shape.w; ++q) y.at(n, o, p, q) = in.at("bias").real[o];
  const std::vector<double>&x = in.at("x").real, &w = in.at("w").real;
  for_products(s, [&](int iy, int ix, int iw) { y.real[iy] += x[ix] * w[iw]; });
  return y;
}

std::vector<Tensor> backward(const Sizes& s, const Tensors& in) {
  Tensor dx(s.x), dw(s.w), db({1, s.w.n, 1, 1});
  const std::vector<double>&x = in.at("x").real, &w = in.at("w").real, &dy = in.at("dy").real;
  for_products(s, [&](int iy, int ix, int iw) { dx.real[ix] += dy[iy] * w[iw], dw.real[iw] += dy[iy] * x[ix]; });
  const Shape y = s.y();
  for (int n = 0; n < y.n; ++n)
    for (int o = 0; o < y.c; ++o)
      for (int p = 0; p < y.h; ++p)
        for (int q = 0; q < y.w; ++q) db.real[o] += in.at("dy").at(n, o, p, q);
  return {dx, dw, db};
}

Tensor integers(Shape shape, std::uint64_t seed) {
  const Tensor t = random_ints(shape, seed, -3, 4);
  return {shape, std::vector<double>(t.integer.begin(), t.integer.end())};
}

Tensors inputs(const Sizes& s) {
  return {{"x", integers(s.x, 1)}, {"w", integers(s.w, 2)}, {"bias", integers({1, s.w.n, 1, 1}, 3)}};
}

Value build(const Sizes& s, ConvKernels kernels, const Values& v) {
  return conv(v.at("x"), v.at("w"), v.at("bias"), s.spec(kernels));
}

OpCase forward_case(const Sizes& s, const Named& k) {
  OpCase c;
  c.stem = "conv", c.label = s.label + "_" + k.name;
  c.kernels = k.forward;
  c.inputs = inputs(s);
  c.build = [=](Graph&, const Values& v) -> std::vector<Value> { return {build(s, k.kernels, v)}; };
  c.reference = [=](const Tensors& in) -> std::vector<Tensor> { return {forward(s, in)}; };
  c.roundings = 0;
  c.differentiate = {"x", "w", "bias"};
  // Bilinear: a central difference has no truncation error, so the step is long. Rounding: at most 3000 terms of at
  // most 9 + 9*step, times epsilon over twice the step: 1e-11 beside gradients of order 1.
  c.step = 0.5, c.gradient_tolerance = 1e-10, c.differences = 25;
  c.gradient_roundings = 4 * std::sqrt(static_cast<double>(s.x.n * s.y().plane() + s.w.item() * s.w.n));
  return c;
}

OpCase backward_case(const Sizes& s, const Named& k) {
  OpCase c;
  c.stem = "conv", c.label = s.label + "_gradients_" + k.name;
  c.kernels = k.backward;
  c.inputs = inputs(s);
  c.inputs["dy"] = integers(s.y(), 4);
  c.build = [=](Graph&, const Values& v) {
    return gradient(std::vector{build(s, k.kernels, v)}, std::vector{v.at("dy")},
                    std::vector{v.at("x"), v.at("w"), v.at("bias")});
  };
  c.reference = [=](const Tensors& in) { return backward(s, in); };
  c.roundings = 0;
  c.no_gradient = "gradients are not differentiated again";
  return c;
}

const std::vector<Sizes>& grid() {
  static const std::vector<Sizes> all{
      {"one_pixel", {2, 3, 1, 1}, {5, 3, 3, 3}, 1, 1},        {"odd", {2, 5, 9, 11}, {13, 5, 3, 3}, 1, 1},
      {"stride2", {2, 5, 13, 10}, {9, 5, 3, 3}, 2, 1},        {"seven_stride2", {1, 3, 20, 23}, {8, 3, 7, 7}, 2, 3},
      {"four_stride2", {1, 4, 12, 14}, {8, 4, 4, 4}, 2, 1},   {"four", {1, 2, 9, 8}, {3, 2, 4, 4}, 1, 2},
      {"pointwise", {3, 70, 5, 7}, {9, 70, 1, 1}, 1, 0},      {"pointwise_stride2", {2, 7, 9, 8}, {9, 7, 1, 1}, 2, 0},
      {"pointwise_padded", {1, 3, 4, 5}, {2, 3, 1, 1}, 1, 1}, {"stride3", {1, 2, 11, 10}, {3, 2, 2, 2}, 3, 0},
      {"valid", {1, 7, 20, 9}, {9, 7, 3, 3}, 1, 0},           {"bottom", {2, 24, 8, 10}, {16, 24, 3, 3}, 1, 1},
      {"wide", {1, 2, 3, 1500}, {3, 2, 3, 3}, 1, 1},          {"long_plane", {1, 17, 40, 60}, {16, 17, 1, 1}, 1, 0},
      {"many_bands", {2, 6, 50, 40}, {9, 6, 3, 3}, 1, 1},     {"deep", {1, 300, 6, 5}, {80, 300, 3, 3}, 1, 1},
  };
  return all;
}

// The convolution of a normalised picture: z = max(0, gamma (x - mean) / sqrt(variance + epsilon) + beta) inside, zero
// in the padding. Numbers that are no integers, so up to the rounding of a sum of `terms` products.
OpCase normalised_case(const Sizes& s, const Named& k, bool relu, std::vector<std::string> launched) {
  constexpr double epsilon = 1e-5;
  OpCase c;
  c.stem = "conv", c.label = s.label + "_normalised_" + k.name;
  c.kernels = std::move(launched);
  const Shape per_channel{1, s.x.c, 1, 1};
  c.inputs = {{"x", random_tensor(s.x, 1)},
              {"w", random_tensor(s.w, 2)},
              {"bias", random_tensor({1, s.w.n, 1, 1}, 3)},
              {"moments", random_tensor({1, s.x.c, 1, 2}, 4, 0.1, 0.6)},
              {"gamma", random_tensor(per_channel, 5)},
              {"beta", random_tensor(per_channel, 6)}};
  c.build = [=](Graph&, const Values& v) -> std::vector<Value> {
    return {conv(v.at("x"), {v.at("moments"), v.at("gamma"), v.at("beta"), relu, epsilon}, v.at("w"), v.at("bias"),
                 s.spec(k.kernels))};
  };
  c.reference = [=](const Tensors& in) -> std::vector<Tensor> {
    Tensors mapped = in;
    Tensor& z = mapped["x"];
    for (int n = 0; n < s.x.n; ++n)
      for (int i = 0; i < s.x.c; ++i)
        for (int p = 0; p < s.x.h; ++p)
          for (int q = 0; q < s.x.w; ++q) {
            const double mean = in.at("moments").real[2 * i], variance = in.at("moments").real[2 * i + 1];
            const double v = in.at("gamma").real[i] * (z.at(n, i, p, q) - mean) / std::sqrt(variance + epsilon) +
                             in.at("beta").real[i];
            z.at(n, i, p, q) = relu ? std::max(v, 0.0) : v;
          }
    return {forward(s, mapped)};
  };
  // Terms of at most 6 (|x - mean| < 1.6, deviation > 0.3, beta < 1) with four roundings each; as many terms as the
  // depth.
  c.roundings = 4.0 * static_cast<double>(s.w.item()), c.magnitude = 6;
  c.differentiate = {"x", "w", "bias", "moments", "gamma", "beta"};
  c.differences = 25;
  c.gradient_roundings = 4.0 * static_cast<double>(s.x.n * s.y().plane());
  return c;
}

OP_CASES(conv) {
  std::vector<OpCase> cases;
  const Sizes bottleneck{"bottleneck", {2, 9, 6, 7}, {10, 9, 1, 1}, 1, 0},
      growth{"growth", {2, 10, 6, 7}, {5, 10, 3, 3}, 1, 1}, reduction{"reduction", {2, 5, 7, 9}, {9, 5, 3, 3}, 2, 1};
  for (const Named& k : all_kernels()) {
    const bool library = k.kernels == ConvKernels::Clblast;
    std::vector<std::string> launched = library ? std::vector<std::string>{"im2col"} : k.forward;
    launched.insert(launched.end(), k.backward.begin(), k.backward.end());
    for (const Sizes& s : {bottleneck, growth, reduction})
      if (!library || s.label != "reduction") cases.push_back(normalised_case(s, k, s.label != "growth", launched));
  }
  for (const Named& k : all_kernels())
    for (const Sizes& s : grid()) {
      const bool library = k.kernels == ConvKernels::Clblast;
      if (library && s.label != "odd" && s.label != "stride2" && s.label != "pointwise") continue;
      cases.push_back(forward_case(s, k)), cases.push_back(backward_case(s, k));
      if (library && s.label != "pointwise") {
        cases[cases.size() - 2].kernels.push_back("im2col");
        cases.back().kernels.push_back("col2im");
      }
      if (s.label == "many_bands") cases.back().kernels.push_back("conv_sum_partials");
    }
  // A device with little local memory: 16 KiB of floats cut channels, rows, columns and outputs into many pieces.
  const std::vector<Sizes> tight{{"tight", {2, 30, 9, 11}, {40, 30, 3, 3}, 1, 1, 4096},
                                 {"tight_wide", {1, 3, 5, 300}, {9, 3, 3, 3}, 1, 1, 4096},
                                 {"tight_stride2", {2, 3, 9, 301}, {9, 3, 7, 7}, 2, 3, 4096},
                                 {"tight_deep", {3, 60, 6, 5}, {17, 60, 3, 3}, 1, 1, 4096},
                                 {"tight_pointwise", {1, 300, 20, 30}, {20, 300, 1, 1}, 1, 0, 4096}};
  for (const Sizes& s : tight) {
    cases.push_back(forward_case(s, all_kernels()[0]));
    cases.push_back(backward_case(s, all_kernels()[0]));
  }
  // More columns than are unrolled at once: two products per item, the second added to the first.
  cases.push_back(backward_case({"split", {1, 40, 128, 96}, {3, 40, 3, 3}, 1, 1}, all_kernels()[2]));
  return cases;
}

Tensors outputs_of(const std::string& gemm, const Sizes& s, const Tensors& in) {
  Graph g;
  Values v;
  for (const auto& [name, tensor] : in) v[name] = g.input(name, tensor.shape);
  std::vector<Value> outputs{build(s, ConvKernels::ByPlan, v)};
  for (const Value& d : gradient(outputs, std::vector{v.at("dy")}, std::vector{v.at("x"), v.at("w"), v.at("bias")}))
    outputs.push_back(d);
  const std::vector<Tensor> t = evaluate(g, outputs, test_device(), in, {.gemm = gemm});
  return {{"y", t[0]}, {"dx", t[1]}, {"dw", t[2]}, {"db", t[3]}};
}

double inner(const Tensor& a, const Tensor& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.real.size(); ++i) sum += a.real[i] * b.real[i];
  return sum;
}

// Both backends, chosen by the plan, on a layer of the net: <y, dy> = <x, dx> + <b, db> = <w, dw> + <b, db> in each,
// and equal values in both. Rounding: every element is a sum of at most 640 positions or 576 products of numbers below
// 1, whose error is below 640 epsilon times their sum's bound, and in practice its root; 64 epsilon times 24 (the root
// of the count, the size that such sums have) leaves four deviations.
TEST(Conv, BackendsAgreeAndAreAdjoint) {
  const Sizes s{"layer", {2, 64, 16, 20}, {16, 64, 3, 3}, 1, 1};
  Tensors in{{"x", random_tensor(s.x, 5)},
             {"w", random_tensor(s.w, 6)},
             {"bias", random_tensor({1, 16, 1, 1}, 7)},
             {"dy", random_tensor(s.y(), 8)}};
  for (auto& [name, tensor] : in)
    for (double& v : tensor.real) v = static_cast<float>(v);
  const Tensors packed = outputs_of("packed", s, in), clblast = outputs_of("clblast", s, in);
  for (const Tensors& t : {packed, clblast}) {
    const double y = inner(t.at("y"), in.at("dy")), b = inner(in.at("bias"), t.at("db"));
    // |y|, |dy| ~ 24, 10240 elements: errors of 64 epsilon * 24 each add up as a random walk.
    const double tolerance = 64 * FLT_EPSILON * 24 * std::sqrt(1.0 * in.at("x").real.size());
    EXPECT_NEAR(y, inner(in.at("x"), t.at("dx")) + b, tolerance);
    EXPECT_NEAR(y, inner(in.at("w"), t.at("dw")) + b, tolerance);
    EXPECT_GT(std::abs(y), 100 * tolerance) << "the identity would hold for zeros";
  }
  for (const auto& [name, tensor] : packed)
    for (std::size_t i = 0; i < tensor.real.size(); ++i)
      ASSERT_NEAR(tensor.real[i], clblast.at(name).real[i], 64 * FLT_EPSILON * 24) << name << " element " << i;
}

// A normalised convolution is its two ops in one: the same sums of the same numbers. The map may be contracted to other
// multiply-adds where it is compiled into another kernel: a few roundings of terms of size 6 each.
TEST(Conv, NormalisedIsNormaliseThenConvolve) {
  const Sizes s{"growth", {2, 32, 16, 20}, {16, 32, 3, 3}, 1, 1};
  Graph g;
  const Value x = g.constant(random_tensor(s.x, 1)), w = g.constant(random_tensor(s.w, 2));
  const Value moments = channel_moments(x), gamma = g.constant(random_tensor({1, 32, 1, 1}, 3)),
              beta = g.constant(random_tensor({1, 32, 1, 1}, 4));
  const Value one = conv(x, {moments, gamma, beta}, w, {}, {1, 1});
  const Value two = conv(normalise_channels(x, moments, gamma, beta, true), w, {}, {1, 1});
  const std::vector<Tensor> t = evaluate(g, {one, two}, test_device(), {});
  for (std::size_t i = 0; i < t[0].real.size(); ++i)
    ASSERT_NEAR(t[0].real[i], t[1].real[i], 4 * FLT_EPSILON * 6 * std::sqrt(288.0)) << i;
}

TEST(Conv, RefusesWhatDoesNotFit) {
  Graph g;
  const Value x = g.input("x", {1, 3, 4, 4});
  EXPECT_THROW(conv(x, g.input("w1", {8, 2, 3, 3}), {}, {1, 1}), Error);  // channels
  EXPECT_THROW(conv(x, g.input("w2", {8, 3, 7, 7}), {}, {1, 1}), Error);  // larger than the padded picture
  EXPECT_THROW(conv(x, g.input("w3", {8, 3, 3, 3}), g.input("b", {1, 7, 1, 1}), {1, 1}), Error);
  EXPECT_THROW(conv(x, g.input("w4", {8, 3, 3, 3}), {}, {0, 1}), Error);  // stride
}

// The bands cover the grid and fit into the scratch they were cut for, for every pass of the grid's shapes and of some
// large ones, whatever the device's local memory; a device with too little is told so.
TEST(Conv, BlocksFitTheirScratch) {
  std::vector<ConvShape> shapes;
  for (const Sizes& s : grid()) shapes.push_back({s.x.c, s.x.h, s.x.w, s.w.n, s.w.h, s.w.w, s.stride, s.pad, 0});
  shapes.push_back({1024, 15, 20, 512, 3, 3, 1, 1, 0});
  shapes.push_back({64, 480, 4000, 64, 7, 7, 2, 3, 0});
  for (const ConvShape& s : shapes)
    for (const std::size_t scratch : {std::size_t{28 * 1024}, std::size_t{128 * 1024}}) {
      std::vector<ConvPass> passes = backward_data_passes(s);
      passes.push_back(forward_pass(s));
      for (std::size_t i = 0; i < passes.size(); ++i) {
        const ConvGeometry& g = passes[i].geometry;
        std::vector<ConvBlocking> blockings{block_pass(g, 2, scratch, 2)};
        if (i + 1 == passes.size())
          for (const int stretch : {16, 512, 1 << 30}) blockings.push_back(block_weights(g, 2, scratch, stretch));
        for (const ConvBlocking& b : blockings) {
          const std::size_t panel = static_cast<std::size_t>(b.channel_block) * (b.strips() * b.plane + g.taps());
          const std::size_t lanes = b.stretch > 0 ? lane_elements(g, b) : 0;
          EXPECT_LE(panel + static_cast<std::size_t>(b.chunk) * b.strips() * b.positions + lanes, scratch);
          EXPECT_GE(b.bands / b.bands_x * b.band_rows, g.grid_h);
          EXPECT_GE(b.bands_x * b.band_columns, g.grid_w);
          EXPECT_EQ(b.positions % 16, 0);
          EXPECT_GE(b.positions, (b.band_rows - 1) * b.pitch + b.band_columns);
        }
      }
    }
  EXPECT_THROW(block_pass(forward_pass({64, 480, 640, 64, 3, 3, 1, 1, 0}).geometry, 1, 100, 2), Error);
}

// Few units have a group each, and groups of one band are no more than that takes: each copies the band's panel for
// itself.
TEST(Conv, GroupsAreCutForTheUnitsOfTheDevice) {
  const auto blocking = [](int units) {
    return block_pass(forward_pass({320, 32, 40, 64, 1, 1, 1, 0, 0}).geometry, 1, 128 * 1024, units);
  };
  const auto groups = [&](int units) {
    const ConvBlocking b = blocking(units);
    return b.bands * ((64 + b.chunk - 1) / b.chunk);
  };
  for (const int units : {1, 2, 4, 8}) EXPECT_GE(groups(units), units);
  EXPECT_EQ(blocking(1).chunk, 64);
  EXPECT_GE(blocking(2).chunk, 32);
  EXPECT_LT(blocking(40).chunk, blocking(2).chunk);
}

}  // namespace
}  // namespace clerestory
