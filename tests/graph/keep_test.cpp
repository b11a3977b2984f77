// What chunks found and their adjoint need not compute again: the same bits, fewer launches, within the memory allowed.
#include <gtest/gtest.h>

#include <random>

#include "host/graph/map_chunks.hpp"
#include "host/graph/plan.hpp"
#include "host/graph/replay.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

Tensor random_tensor(const Shape& shape, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Tensor t(shape);
  for (double& x : t.real) x = uniform(generator);
  return t;
}

/// y = 2 x, without a gradient, and how often that was computed.
struct SlowOp : Op, WorthKeeping {
  int* launches;
  explicit SlowOp(int* count) : launches(count) {}
  std::string name() const override { return "slow"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  Slope slope(int, int) const override { return Slope::Detached; }
  std::vector<Value> adjoint(const Node&, std::span<const Value>) const override { return {{}}; }
  void launch(Launch& l) const override {
    ++*launches;
    const int count = static_cast<int>(l.in(0).shape.count());
    l.run("tensor/accumulate.cl", "accumulate", Range::of2(static_cast<std::size_t>(count), 1), l.in(0), l.in(0),
          l.out(), count);
  }
};

/// At every pixel x slow(x) slow(slow(x)), once for every chunk of samples: 70 pixels in 9 chunks, samples in 2.
struct Chunks {
  Graph graph;
  int launches = 0;
  ChunkDomain domain{2, 5, 7, 3, 8, 2};
  Value x = graph.input("x", {2, 3, 5, 7}), w = graph.input("w", {2, 3, 5, 7});
  static constexpr int kChunks = 18;
  static constexpr std::size_t kBytes = kChunks * 2 * 3 * 8 * 4;

  Value map() {
    return map_chunks(graph, domain, std::span(&x, 1), [this](Graph& g, std::span<const Value> in) {
      const Value tile = take_pixels(in[0], domain.chunk_pixels);
      const Value once = g.make<SlowOp>({tile}, &launches), twice = g.make<SlowOp>({once}, &launches);
      return std::vector<ChunkOutput>{{multiply(multiply(tile, once), twice)}};
    })[0];
  }
  Value slope(Value y) { return gradient(sum(multiply(y, w)), std::span(&x, 1))[0]; }

  struct Run {
    std::vector<std::vector<double>> values;
    int launches = 0;
    std::string notes;
  };
  Run run(const std::vector<Value>& outputs, const PlanOptions& options) {
    Executor executor(compile(graph, outputs, device(), options));
    executor.feed("x", random_tensor(x.shape(), 3)), executor.feed("w", random_tensor(x.shape(), 4));
    launches = 0;
    executor.run(7);
    Run result;
    for (const Value& v : outputs) result.values.push_back(executor.fetch(v).real);
    result.launches = launches;
    for (const std::string& note : executor.plan().notes) result.notes += note + '\n';
    return result;
  }
};

TEST(Keep, TheAdjointReadsWhatChunksFound) {
  Chunks c;
  const Value y = c.map(), dx = c.slope(y);
  const Chunks::Run again = c.run({y, dx}, {.keep = 0});
  EXPECT_EQ(again.launches, 2 * 2 * Chunks::kChunks);
  const Tensor x = random_tensor(c.x.shape(), 3), w = random_tensor(c.x.shape(), 4);
  for (std::size_t i = 0; i < x.real.size(); ++i)  // 2 x times 4 x, in two chunks of samples
    EXPECT_NEAR(again.values[1][i], 16 * x.real[i] * x.real[i] * w.real[i], 4 * 16 * 0x1p-24);
  for (int passes = 0; passes < 16; ++passes) {
    const Chunks::Run kept = c.run({y, dx}, {.prune = (passes & 1) != 0,
                                             .alias = (passes & 2) != 0,
                                             .reuse = (passes & 4) != 0,
                                             .reorder = (passes & 8) != 0});
    EXPECT_EQ(kept.values, again.values);
    const bool pruned = (passes & 1) != 0;  // else what nobody reads runs, too
    EXPECT_EQ(kept.launches, (pruned ? 2 : 4) * Chunks::kChunks) << kept.notes;
  }
}

TEST(Keep, WhatDoesNotFitIsComputedAgain) {
  Chunks c;
  const Value y = c.map(), dx = c.slope(y);
  const Chunks::Run over = c.run({y, dx}, {.keep = Chunks::kBytes - 1}),
                    fits = c.run({y, dx}, {.keep = Chunks::kBytes});
  EXPECT_EQ(over.launches, 2 * 2 * Chunks::kChunks);
  EXPECT_EQ(fits.launches, 2 * Chunks::kChunks);
  EXPECT_EQ(over.values, fits.values);
  EXPECT_NE(over.notes.find("map_chunks runs it again"), std::string::npos) << over.notes;
  EXPECT_NE(fits.notes.find("map_chunks does not run again"), std::string::npos) << fits.notes;
  const auto twin = [&](std::size_t keep) { return c.run({y, dx}, {.precision = Precision::Double, .keep = keep}); };
  EXPECT_EQ(twin(2 * Chunks::kBytes - 1).launches, 2 * 2 * Chunks::kChunks);
  EXPECT_EQ(twin(2 * Chunks::kBytes).launches, 2 * Chunks::kChunks);
}

TEST(Keep, ABudgetKeepsNothing) {
  Chunks c;
  const Value y = c.map(), dx = c.slope(y);
  const Chunks::Run run = c.run({y, dx}, {.budget = std::size_t{1} << 30});
  EXPECT_EQ(run.launches, 2 * 2 * Chunks::kChunks);
  EXPECT_EQ(run.notes.find("keep:"), std::string::npos) << run.notes;
}

TEST(Keep, APictureAloneKeepsNothing) {
  Chunks c;
  const Value y = c.map();
  c.slope(y);
  const Plan with = compile(c.graph, {y}, device()), without = compile(c.graph, {y}, device(), {.keep = 0});
  EXPECT_EQ(with.memory().total(), without.memory().total());
  EXPECT_EQ(with.notes, without.notes);
}

// The forward pass of the second draw is for its gradient alone, and does not run.
TEST(Keep, TwoDrawsShareNothing) {
  Chunks c;
  const Value y = c.map();
  c.graph.draws(1);
  const Value other = c.map();
  c.graph.draws(0);
  const Value dx = gradient(std::vector{other}, std::vector{y}, std::vector{c.x})[0];
  const Chunks::Run run = c.run({y, dx}, {});
  EXPECT_EQ(run.launches, 2 * 2 * Chunks::kChunks);
  EXPECT_EQ(run.notes.find("keep:"), std::string::npos) << run.notes;
  EXPECT_EQ(run.values, c.run({y, dx}, {.keep = 0}).values);
}

TEST(Keep, AdjointsOfOneNodeShareWhatItFound) {
  Chunks c;
  const Value y = c.map(), one = c.slope(y), two = c.slope(multiply(y, y));
  const Chunks::Run again = c.run({y, one, two}, {.keep = 0}), kept = c.run({y, one, two}, {.keep = Chunks::kBytes});
  EXPECT_EQ(kept.values, again.values);
  EXPECT_EQ(again.launches, 3 * 2 * Chunks::kChunks);
  EXPECT_EQ(kept.launches, 2 * Chunks::kChunks);
}

TEST(Keep, WhereOnlySomeChunksRun) {
  Chunks c;
  c.domain.every = 4;
  const Value y = c.map(), dx = c.slope(y);
  const Chunks::Run again = c.run({sum(y), dx}, {.keep = 0}), kept = c.run({sum(y), dx}, {});
  EXPECT_EQ(again.launches, 2 * 2 * 5);
  EXPECT_EQ(kept.launches, 2 * 5);
  // Two chunks of samples for each of pixels: every other one of pixels runs, what others give means nothing.
  for (int n = 0; n < 2; ++n)
    for (int pixel = 0; pixel < 35; ++pixel)
      for (int c = 0; (n * 35 + pixel) / 8 % 2 == 0 && c < 3; ++c) {
        const std::size_t at = static_cast<std::size_t>((n * 3 + c) * 35 + pixel);
        EXPECT_EQ(kept.values[1][at], again.values[1][at]) << n << " " << c << " " << pixel;
      }
}

// The sum of s^2 slow(x) over pixels: the adjoint reads slow(x), the adjoint's own adjoint computes it again.
TEST(Keep, AdjointsOfAdjointsStayRight) {
  Chunks c;
  const Shape tile{1, 3, 8, 1};
  const Value y = map_chunks(c.graph, c.domain, std::span(&c.x, 1), [&](Graph& g, std::span<const Value> in) {
    const Value s = g.state("s", tile, Init::constant(0.5)),
                slow = g.make<SlowOp>({take_pixels(in[0], 8)}, &c.launches);
    return std::vector<ChunkOutput>{{sum(multiply(multiply(s, s), slow)), true}};
  })[0];
  const Value s = c.graph.state("s", tile, Init::constant(0.5));
  const Value ds = gradient(y, std::span(&s, 1))[0], dds = gradient(sum(ds), std::span(&s, 1))[0];
  const auto states = std::make_shared<States>(device());
  states->initialise(c.graph, 1);
  std::vector<std::vector<double>> values;
  std::vector<int> launches;
  for (const std::size_t keep : {std::size_t{0}, Chunks::kBytes}) {
    c.launches = 0;
    for (const Tensor& t :
         evaluate(c.graph, {y, ds, dds}, device(), {{"x", random_tensor(c.x.shape(), 3)}}, {.keep = keep}, 0, states))
      values.push_back(t.real);
    launches.push_back(c.launches);
  }
  EXPECT_EQ(launches, (std::vector<int>{3 * Chunks::kChunks, 2 * Chunks::kChunks}));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(values[i], values[i + 3]);
  for (std::size_t i = 0; i < values[1].size(); ++i) EXPECT_FLOAT_EQ(2 * values[1][i], values[2][i]);  // s is a half
}

TEST(Keep, ABodyThatIsAnotherTheSecondTimeIsRefused) {
  Graph g;
  const Value x = g.input("x", {1, 1, 2, 2});
  int built = 0;
  const Value y = map_chunks(g, {1, 2, 2, 1, 4, 1}, std::span(&x, 1), [&](Graph&, std::span<const Value> in) {
    const Value tile = take_pixels(in[0], 4);
    return std::vector<ChunkOutput>{{++built == 1 ? multiply(tile, tile) : tile}};
  })[0];
  const std::string said = message_of([&] { gradient(sum(y), std::span(&x, 1)); }, ErrorKind::Failed);
  EXPECT_NE(said.find("another"), std::string::npos) << said;
}

}  // namespace
}  // namespace clerestory
