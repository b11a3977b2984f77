// Convolution: exact equality with a plain reference on integers (products and sums of small integers are exact in
// float) over a grid of shapes, for the values and all three gradients, on every set of kernels; finite differences in
// double.
#include "host/ops/nn/conv.hpp"

#include <cmath>

#include "checks/nn/conv_sizes.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace conv_sizes;

struct Named {
  std::string name;
  ConvKernels kernels;
  std::vector<std::string> forward, backward;
  std::size_t group = 1;
};

const std::vector<Named>& all_kernels() {
  static const std::vector<Named> all{
      {"cpu", ConvKernels::Cpu, {"conv_pack_weights", "conv_cpu"}, {"conv_bias_gradient"}},
      {"winograd", ConvKernels::Winograd, {"conv_winograd_weights", "conv_winograd"}, {"conv_bias_gradient"}},
      {"gpu", ConvKernels::Gpu, {"conv_pack_weights", "conv_gpu"}, {"conv_weights_gpu", "conv_bias_gradient"}, 128},
      {"clblast", ConvKernels::Clblast, {"conv_fill_bias"}, {"conv_bias_gradient"}}};
  return all;
}

/// Reals of local memory for backward weights by minimal filtering; with less the direct form stands in.
constexpr std::size_t kWinogradWeights = 14'000;
/// Those that the direct form needs of a stride 2 and 7x7 taps, where it is told to run: 48 KiB are too few for
/// doubles.
constexpr std::size_t kSevenTaps = 7'100;

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

bool is_for(const Named& k, const Sizes& s) {
  return k.kernels != ConvKernels::Winograd || (s.w.h == 3 && s.w.w == 3 && s.stride == 1);
}

OpCase forward_case(const Sizes& s, const Named& k) {
  OpCase c;
  c.stem = "conv", c.label = s.label + "_" + k.name;
  c.kernels = k.forward, c.group = k.group;
  if (k.kernels == ConvKernels::Cpu && s.w.h == 7) c.least_local_elements = kSevenTaps;
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

// The forms of backward weights on a CPU: direct ones are dot products where eight outputs or fewer would not fill
// vectors.
std::vector<std::string> backward_kernels(const Sizes& s, const Named& k) {
  std::vector<std::string> kernels = k.backward;
  if (k.kernels == ConvKernels::Winograd) kernels.push_back("conv_winograd_gradient");
  if (k.kernels == ConvKernels::Cpu) kernels.push_back(s.w.n > 8 ? "conv_weights_outer" : "conv_weights_dot");
  return kernels;
}

OpCase backward_case(const Sizes& s, const Named& k) {
  OpCase c;
  c.stem = "conv", c.label = s.label + "_gradients_" + k.name;
  c.kernels = backward_kernels(s, k), c.group = k.group;
  if (k.kernels == ConvKernels::Cpu && s.w.h == 7) c.least_local_elements = kSevenTaps;
  if (k.kernels == ConvKernels::Winograd) c.local_elements = kWinogradWeights;
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

// The convolution of a normalised picture: z = max(0, gamma (x - mean) / sqrt(variance + epsilon) + beta) inside, zero
// in the padding. Numbers that are no integers, so up to the rounding of a sum of `terms` products.
OpCase normalised_case(const Sizes& s, const Named& k, bool relu, std::vector<std::string> launched) {
  constexpr double epsilon = 1e-5;
  OpCase c;
  c.stem = "conv", c.label = s.label + "_normalised_" + k.name;
  c.kernels = std::move(launched), c.group = k.group;
  if (k.kernels == ConvKernels::Winograd) c.local_elements = kWinogradWeights;
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
    for (const Sizes& s : {bottleneck, growth, reduction}) {
      if ((library && s.label == "reduction") || !is_for(k, s)) continue;
      std::vector<std::string> both = launched;
      for (const std::string& kernel : backward_kernels(s, k)) both.push_back(kernel);
      cases.push_back(normalised_case(s, k, s.label != "growth", both));
    }
  }
  // Rows of weights a multiple of 4 KiB apart compete for the same cache sets: packed, where others are read as stored.
  cases.push_back(normalised_case({"far_rows", {1, 1024, 2, 3}, {3, 1024, 1, 1}, 1, 0}, all_kernels()[0], true,
                                  {"conv_pack_weights", "conv_cpu", "conv_weights_dot", "conv_bias_gradient"}));
  for (const Named& k : all_kernels())
    for (const Sizes& s : grid()) {
      const bool library = k.kernels == ConvKernels::Clblast;
      if (library && s.label != "odd" && s.label != "stride2" && s.label != "pointwise") continue;
      if (!is_for(k, s)) continue;
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
                                 {"tight_many", {5, 20, 4, 5}, {50, 20, 3, 3}, 1, 1, 4096},
                                 {"tight_deep", {3, 60, 6, 5}, {17, 60, 3, 3}, 1, 1, 4096},
                                 {"tight_pointwise", {1, 300, 20, 30}, {20, 300, 1, 1}, 1, 0, 4096}};
  for (const Sizes& s : tight) {
    cases.push_back(forward_case(s, all_kernels()[0]));
    cases.push_back(backward_case(s, all_kernels()[0]));
  }
  // 64 KiB: bands of some tiles, a few channels and one panel of outputs at a time.
  for (const Sizes& s : {Sizes{"tight_winograd", {2, 30, 9, 11}, {40, 30, 3, 3}, 1, 1, 16384},
                         Sizes{"tight_winograd_wide", {1, 3, 5, 300}, {9, 3, 3, 3}, 1, 1, 16384},
                         Sizes{"tight_winograd_many", {5, 20, 4, 5}, {50, 20, 3, 3}, 1, 1, 16384},
                         // More channels of a group than are transformed back at once.
                         Sizes{"refill", {1, 600, 4, 5}, {16, 600, 3, 3}, 1, 1}}) {
    cases.push_back(forward_case(s, all_kernels()[1]));
    cases.push_back(backward_case(s, all_kernels()[1]));
  }
  // Too little for backward weights by minimal filtering: the direct form stands in.
  OpCase small = backward_case({"small_winograd", {2, 20, 9, 11}, {20, 20, 3, 3}, 1, 1, 7000}, all_kernels()[1]);
  small.kernels = {"conv_winograd", "conv_weights_outer"}, small.local_elements = 7000;
  cases.push_back(small);
  // More columns than are unrolled at once: two products per item, the second added to the first.
  OpCase split = backward_case({"split", {1, 40, 128, 96}, {3, 40, 3, 3}, 1, 1}, all_kernels()[3]);
  split.piece_elements = 12 << 20;  // three workspaces of 4 << 20
  cases.push_back(split);
  return cases;
}

}  // namespace
}  // namespace clerestory
