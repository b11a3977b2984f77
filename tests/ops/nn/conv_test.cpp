// Convolution: both backends in a plan, a normalisation before it, how work is cut into blocks, what is refused.
#include "host/ops/nn/conv.hpp"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "checks/nn/conv_sizes.hpp"
#include "checks/op_case.hpp"
#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv_geometry.hpp"
#include "host/ops/nn/winograd_blocking.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using namespace conv_sizes;

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
        const ConvBlocking& whole = blockings[0];
        EXPECT_LE(static_cast<std::size_t>(whole.channel_block) * (whole.plane + g.taps()) +
                      static_cast<std::size_t>(whole.chunk) * whole.positions,
                  scratch);
        if (i + 1 == passes.size()) {
          blockings.push_back(block_weights(g, 2, scratch));
          EXPECT_LE(weights_form(g, blockings[1]).elements() + blockings[1].channel_block * g.taps(), scratch);
          EXPECT_LE(blockings[1].partials, most_partials(g)) << "the workspace holds no more";
        }
        for (const ConvBlocking& b : blockings) {
          EXPECT_GE(b.bands / b.bands_x * b.band_rows, g.grid_h);
          EXPECT_GE(b.bands_x * b.band_columns, g.grid_w);
          EXPECT_EQ(b.positions % 16, 0);
          EXPECT_GE(b.positions, (b.band_rows - 1) * b.pitch + b.band_columns);
        }
      }
    }
  EXPECT_THROW(block_pass(forward_pass({64, 480, 640, 64, 3, 3, 1, 1, 0}).geometry, 1, 100, 2), Error);
}

// A plan takes minimal filtering for large 3x3 convolutions, and "direct" leaves it out: other roundings of the same
// sums. Each is as near to the sum in double as 1,110 products of numbers below 1 may be (their root is below 34).
TEST(Conv, DirectLeavesMinimalFilteringOut) {
  const Sizes s{"layer", {1, 64, 30, 37}, {24, 64, 3, 3}, 1, 1};
  Tensors in{{"x", random_tensor(s.x, 5)},
             {"w", random_tensor(s.w, 6)},
             {"bias", random_tensor({1, 24, 1, 1}, 7)},
             {"dy", random_tensor(s.y(), 8)}};
  const Tensors packed = outputs_of("packed", s, in), direct = outputs_of("direct", s, in);
  for (const char* name : {"y", "dx", "dw"}) {
    EXPECT_NE(packed.at(name).real, direct.at(name).real) << name << " has the same bits: one form ran twice";
    for (std::size_t i = 0; i < packed.at(name).real.size(); ++i)
      ASSERT_NEAR(packed.at(name).real[i], direct.at(name).real[i], 64 * FLT_EPSILON * 34) << name << " element " << i;
  }
}

// Channels ascend whatever the cut, so that bits depend neither on bands, chunks and channel blocks nor on the batch.
TEST(Conv, MinimalFilteringGivesTheSameBitsHoweverItIsCut) {
  const Shape x{3, 37, 19, 45}, w{29, 37, 3, 3};
  const Tensors in{{"x", random_tensor(x, 1)}, {"w", random_tensor(w, 2)}, {"bias", random_tensor({1, 29, 1, 1}, 3)}};
  const auto result = [&](int scratch) {
    Graph g;
    const Value y =
        conv(g.input("x", x), g.input("w", w), g.input("bias", {1, 29, 1, 1}), {1, 1, ConvKernels::Winograd, scratch});
    return evaluate(g, {y}, test_device(), in)[0].real;
  };
  const std::vector<double> whole = result(0);
  for (const int scratch : {16384, 24576, 50000}) EXPECT_EQ(result(scratch), whole) << scratch;
}

// A layer of a decoder, one wide, one deep, and one of a single position.
constexpr ConvShape kFilteredShapes[]{{64, 60, 80, 64, 3, 3, 1, 1, 0},
                                      {3, 5, 1400, 9, 3, 3, 1, 1, 0},
                                      {1024, 15, 20, 512, 3, 3, 1, 1, 0},
                                      {7, 3, 3, 5, 3, 3, 1, 0, 0}};

void expect_all_tiles_covered(const WinogradBlocking& b, const ConvGeometry& g, int batch) {
  EXPECT_GE(b.positions, b.band_rows * b.band_columns);
  EXPECT_GE(b.bands_x * b.band_columns, (g.grid_w + 1) / 2);
  EXPECT_GE(b.bands() / b.bands_x * b.band_rows, batch * ((g.grid_h + 1) / 2));
}

TEST(Conv, WinogradBlocksFitTheirScratchAndCoverAllTiles) {
  int fitted = 0;
  for (const ConvShape& s : kFilteredShapes)
    for (const int batch : {1, 5})
      for (const std::size_t scratch : {std::size_t{16 * 1024}, std::size_t{128 * 1024}}) {
        const ConvGeometry g = forward_pass(s).geometry;
        const auto b = block_winograd(g, batch, scratch, 2);
        ASSERT_TRUE(b);
        ++fitted;
        EXPECT_LE(b->elements(), scratch);
        EXPECT_EQ(b->chunk % conv_tile, 0);
        EXPECT_GE(b->channel_block, 1);
        expect_all_tiles_covered(*b, g, batch);
      }
  EXPECT_EQ(fitted, 16);
  EXPECT_FALSE(block_winograd(forward_pass({64, 60, 80, 64, 3, 3, 1, 1, 0}).geometry, 1, 2000, 2));
  EXPECT_FALSE(is_winograd(forward_pass({64, 60, 80, 64, 3, 3, 2, 1, 0}).geometry)) << "stride";
  EXPECT_FALSE(is_winograd(forward_pass({64, 60, 80, 64, 5, 5, 1, 2, 0}).geometry)) << "taps";
}

TEST(Conv, BackwardWeightsAreFilteredWhereABatchIsLargeEnough) {
  const auto prefers = [](int channels, int outputs, int height, int batch, int kernel = 3, int stride = 1) {
    return prefers_winograd_weights(
        forward_pass({channels, height, 8, outputs, kernel, kernel, stride, kernel / 2, 0}).geometry, batch);
  };
  EXPECT_TRUE(prefers(16, 16, 32, 1));
  EXPECT_TRUE(prefers(16, 16, 4, 8)) << "256 positions of a batch";
  EXPECT_FALSE(prefers(16, 16, 31, 1)) << "248";
  EXPECT_FALSE(prefers(15, 16, 32, 1));
  EXPECT_FALSE(prefers(16, 15, 32, 1));
  EXPECT_FALSE(prefers(16, 16, 64, 1, 3, 2)) << "stride";
  EXPECT_FALSE(prefers(16, 16, 32, 1, 5)) << "taps";
}

TEST(Conv, WinogradBlocksOfBackwardWeightsFitTheirScratchAndCoverAllTiles) {
  int fitted = 0;
  for (const ConvShape& s : kFilteredShapes)
    for (const int batch : {1, 5})
      for (const std::size_t scratch : {std::size_t{16 * 1024}, std::size_t{128 * 1024}}) {
        const ConvGeometry g = forward_pass(s).geometry;
        const auto b = block_winograd_weights(g, batch, scratch);
        ASSERT_TRUE(b);
        ++fitted;
        EXPECT_LE(b->weight_elements(), scratch);
        EXPECT_GE(b->weight_lines(), std::size_t(2 * 2 * b->band_columns) * std::min(b->chunk, 48))
            << "two target rows";
        EXPECT_EQ(b->chunk % 16, 0);
        EXPECT_EQ(b->channel_block % conv_tile, 0);
        EXPECT_GE(b->channel_block, 1);
        EXPECT_GE(b->partials, 1);
        expect_all_tiles_covered(*b, g, batch);
        EXPECT_LE(b->partials, std::min(most_partials(g), b->bands()))
            << "a partial has a band, and room is for so many";
      }
  EXPECT_EQ(fitted, 16);
  EXPECT_FALSE(block_winograd_weights(forward_pass({64, 60, 80, 64, 3, 3, 1, 1, 0}).geometry, 1, 2000));
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
