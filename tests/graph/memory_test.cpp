// What a plan needs: the order of its steps, values that are computed again under a budget, and the sum to the byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/graph/map_chunks.hpp"
#include "host/graph/plan.hpp"
#include "host/graph/replay.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/adam.hpp"
#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/depthwise.hpp"
#include "host/ops/nn/group_norm.hpp"
#include "host/ops/nn/pool.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/pad.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/least_memory.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

Tensor numbered(const Shape& shape, std::uint32_t seed) {
  Tensor t(shape);
  for (double& x : t.real) x = static_cast<double>((seed = seed * 1664525u + 1013904223u) >> 8) * 0x1p-23 - 1;
  return t;
}

/// A net with an encoder whose features several branches read until the end, each with a loss of its own, and a step of
/// Adam. Between them they hold every kind of op that computes again what a branch reads.
struct Branches {
  Graph graph;
  std::vector<Value> losses;
  Value total;

  Value parameter(const std::string& name, const Shape& shape) { return graph.state(name, shape, Init::uniform(0.3)); }
  Value convolved(const std::string& name, Value x, int out) {
    return conv(x, parameter(name, {out, x.shape().c, 3, 3}), parameter(name + ".b", {1, out, 1, 1}), {.pad = 1});
  }
  Value batch_normalised(const std::string& name, Value x) {
    const Shape per_channel{1, x.shape().c, 1, 1};
    const Value moments = channel_moments(x);
    update_running(moments, graph.state(name + ".mean", per_channel, Init::fixed(0)),
                   graph.state(name + ".variance", per_channel, Init::fixed(1)), x.shape().n * x.shape().plane());
    return normalise_channels(x, moments, parameter(name + ".g", per_channel), parameter(name + ".o", per_channel),
                              true);
  }
  Value group_normalised(const std::string& name, Value x) {
    const Shape per_channel{1, x.shape().c, 1, 1};
    return group_norm(x, parameter(name + ".g", per_channel), parameter(name + ".o", per_channel), 2, true);
  }
  Value branch(const std::string& name, Value low, Value high) {
    const Value up = resize_bilinear(group_normalised(name + ".n1", convolved(name + ".c1", low, 8)), 32, 32);
    Value x = convolved(name + ".c2", concat(std::vector{up, high}), 8);
    x = pad_replicate(batch_normalised(name + ".n2", x), {1, 1, 1, 1});
    x = activate(convolved(name + ".c3", slice(x, 2, 6), 4), Function::SignedUnit);
    x = add(multiply(x, x), affine(x, 0.5, 1));
    x = depthwise(x, parameter(name + ".d", {4, 1, 3, 3}), parameter(name + ".db", {1, 4, 1, 1}), 1);
    x = multiply(relu(x), activate(reshape(x, x.shape()), Function::Exp));
    return sum(multiply(max_pool(x), average_pool(x)));
  }

  Branches() {
    const Value image = graph.input("image", {2, 3, 32, 32});
    const Value high = batch_normalised("e1", convolved("e0", image, 8));
    const Value low = average_pool(relu(convolved("e2", high, 8)));
    for (int b = 0; b < 3; ++b) losses.push_back(branch(fmt::format("b{}", b), low, high));
    total = losses[0];
    for (std::size_t b = 1; b < losses.size(); ++b) total = add(total, losses[b]);
    const std::vector<Value> parameters = graph.parameters();
    adam(parameters, gradient(total, parameters), graph.fill({}, 1e-2), graph.fill({}, 1));
    losses.push_back(total);
  }

  struct Outcome {
    std::vector<std::vector<double>> values;  // the losses of three steps, and every state after them
    std::size_t arena = 0;
  };
  Outcome trained(const PlanOptions& options) const {
    const auto states = std::make_shared<States>(device(), options.precision);
    states->initialise(graph, 3);
    Executor run(compile(graph, losses, device(), options, true), states);
    run.feed("image", numbered({2, 3, 32, 32}, 5));
    Outcome outcome{{}, run.plan().arena_bytes};
    for (std::uint32_t step = 0; step < 3; ++step) {
      run.run(step);
      for (const Value& v : losses) outcome.values.push_back(run.fetch(v).real);
    }
    for (const std::string& name : states->names()) outcome.values.push_back(states->get(name).real);
    return outcome;
  }
};

bool says(const Plan& plan, const std::string& what) {
  return std::ranges::any_of(plan.notes, [&](const std::string& n) { return n.find(what) != std::string::npos; });
}

TEST(Order, LeavesStepsAndStatesAsTheyAreAndNeedsLess) {
  const Branches net;
  const auto as_made = net.trained({.reorder = false}), ordered = net.trained({});
  EXPECT_EQ(ordered.values, as_made.values);
  EXPECT_LT(ordered.arena, 0.7 * static_cast<double>(as_made.arena));  // one of three branches at a time
  for (const double v : as_made.values[0]) EXPECT_TRUE(std::isfinite(v));
}

// An update that runs early must wait for whoever reads what it writes, through views too.
TEST(Order, AnUpdateWaitsForEveryReaderOfItsState) {
  Graph g;
  const Shape shape{1, 2, 4, 4};
  const Value w = g.state("w", shape, Init::constant(1)), x = g.input("x", shape);
  const Value seen = slice(reshape(w, {1, 4, 2, 4}), 1, 2);  // a view of a view
  const Value dw = scale(x, 2);
  adam(std::vector{w}, std::vector{dw}, g.fill({}, 0.5), g.fill({}, 1));
  Value late = x;
  for (int i = 0; i < 4; ++i) late = relu(affine(late, 1, 1));
  const Value read = add(slice(reshape(late, {1, 4, 2, 4}), 1, 2), seen);
  const auto states = std::make_shared<States>(device());
  states->initialise(g, 1);
  Executor run(compile(g, {read}, device(), {}, true), states);
  run.feed("x", Tensor(shape, 1));
  run.run();
  for (const double v : run.fetch(read).real) EXPECT_EQ(v, 1 + 4 + 1);  // of w as it was
  for (const double v : states->get("w").real) EXPECT_NEAR(v, 0.5, 1e-6);
}

TEST(Budget, WhatIsComputedAgainHasTheSameBits) {
  const Branches net;
  for (const bool reorder : {false, true})
    for (const Precision precision : {Precision::Single, Precision::Double}) {
      PlanOptions options{.precision = precision, .reorder = reorder};
      const auto free = net.trained(options);
      const std::size_t whole = compile(net.graph, net.losses, device(), options, true).memory().total();
      const std::size_t least = least_memory(net.graph, net.losses, device(), true, options);
      ASSERT_LT(least, 0.9 * static_cast<double>(whole));
      for (const std::size_t budget : {least, (least + whole) / 2}) {
        options.budget = budget;
        const Plan plan = compile(net.graph, net.losses, device(), options, true);
        EXPECT_LE(plan.memory().total(), budget);
        EXPECT_TRUE(says(plan, "recompute:"));
        EXPECT_EQ(net.trained(options).values, free.values) << budget;
      }
    }
}

TEST(Budget, ThatCannotBeMetIsAnErrorThatNamesTheLeast) {
  const Branches net;
  const std::size_t least = least_memory(net.graph, net.losses, device(), true);
  PlanOptions options{.budget = least * 9 / 10, .budget_name = "train.memory_mib (maps.toml)"};
  const std::string said = message_of<Error>([&] { compile(net.graph, net.losses, device(), options, true); });
  EXPECT_NE(said.find("train.memory_mib (maps.toml)"), std::string::npos) << said;
  EXPECT_NE(said.find(fmt::format("at least {:.1f} MiB", static_cast<double>(least) / 0x1p20)), std::string::npos)
      << said;
}

TEST(Budget, ThatIsMetAnywayChangesNothing) {
  const Branches net;
  const Plan free = compile(net.graph, net.losses, device(), {}, true);
  const Plan plan = compile(net.graph, net.losses, device(), {.budget = free.memory().total()}, true);
  EXPECT_EQ(plan.steps.size(), free.steps.size());
  EXPECT_EQ(plan.memory().total(), free.memory().total());
}

/// Its input, and how often that was asked for.
struct CountOp : NotDifferentiable {
  int* runs;
  explicit CountOp(int* r) : runs(r) {}
  std::string name() const override { return "count"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  void launch(Launch& l) const override {
    ++*runs;
    l.device.copy(l.in(0).buffer, l.out().buffer, static_cast<std::size_t>(l.in(0).shape.count()) * 4,
                  l.in(0).offset * 4, l.out().offset * 4);
  }
};

TEST(Budget, UpdatesRunOnceWhateverElseRunsAgain) {
  int runs = 0;
  Graph g;
  const Shape shape{1, 4, 256, 256};  // a megabyte
  const Value state = g.state("s", shape, Init::fixed(1)), x = g.input("x", shape);
  const Value early = g.make<CountOp>({add(x, state)}, &runs);
  const Value large = concat(std::vector{relu(x), scale(x, 2), scale(x, 3)}), between = sum(multiply(large, large));
  const Value moments = channel_moments(x);
  update_running(moments, g.state("mean", {1, 4, 1, 1}, Init::fixed(0)),
                 g.state("variance", {1, 4, 1, 1}, Init::fixed(1)), 256 * 256);
  const Value late = sum(multiply(early, expand(between, shape)));
  const std::vector<Value> outputs{late};
  const auto run = [&](std::size_t budget) {
    const auto states = std::make_shared<States>(device());
    states->initialise(g, 1);
    Executor executor(compile(g, outputs, device(), {.reorder = false, .budget = budget}, true), states);
    executor.feed("x", numbered(shape, 9));
    runs = 0;
    executor.run();
    return std::pair{executor.fetch(late).real, states->get("mean").real};
  };
  const auto free = run(0);
  EXPECT_EQ(runs, 1);
  EXPECT_EQ(run(least_memory(g, outputs, device(), true, {.reorder = false})), free);
  EXPECT_EQ(runs, 2);
}

/// What the device has allocated beside what there was before.
std::size_t allocated(const Graph& graph, const std::vector<Value>& outputs, const std::map<std::string, Tensor>& feeds,
                      const PlanOptions& options, bool updates) {
  const std::size_t before = device().memory_now();
  const auto states = std::make_shared<States>(device(), options.precision);
  states->initialise(graph, 1);
  Executor run(compile(graph, outputs, device(), options, updates), states);
  for (const auto& [name, tensor] : feeds) run.feed(name, tensor);
  device().reset_memory_peak();
  run.run();
  EXPECT_EQ(device().memory_peak(), device().memory_now()) << "a run allocates";
  EXPECT_EQ(run.plan().memory().total(), device().memory_now() - before);
  return run.plan().memory().total();
}

TEST(Memory, IsPredictedToTheByte) {
  const Branches net;
  const std::map<std::string, Tensor> feeds{{"image", numbered({2, 3, 32, 32}, 5)}};
  for (const Precision precision : {Precision::Single, Precision::Double})
    allocated(net.graph, net.losses, feeds, {.precision = precision}, true);
  const std::size_t least = least_memory(net.graph, net.losses, device(), true);
  EXPECT_LE(allocated(net.graph, net.losses, feeds, {.budget = least}, true), least);
}

TEST(Memory, OfBodiesIsCounted) {
  Graph g;
  const Value x = g.input("x", {1, 3, 64, 64});
  const ChunkDomain domain{1, 64, 64, 1, 1024, 1};
  const Value y = map_chunks(g, domain, std::span(&x, 1), [&](Graph& inner, std::span<const Value> in) {
    const Value w = inner.state("w", {8, 3, 1, 1}, Init::uniform(1)), b = inner.constant(numbered({1, 8, 1, 1}, 3));
    const Value wide = conv(take_pixels(in[0], domain.chunk_pixels), w, b);
    return std::vector<ChunkOutput>{{multiply(relu(wide), wide), false}};
  })[0];
  const Value w = g.states().front();
  const std::vector<Value> outputs{y, gradient(sum(y), std::span(&w, 1))[0]};
  allocated(g, outputs, {{"x", numbered(x.shape(), 5)}}, {}, false);
  const PlanMemory memory = compile(g, outputs, device()).memory();
  const std::size_t chunk = 8 * 1024 * 4;
  EXPECT_GE(memory.bodies, 2 * 2 * chunk + 2 * 8 * 4);  // forward and backward: two values and a constant each
}

/// y = x + x, which has no gradient and is worth keeping.
struct DoubledOp : NotDifferentiable, WorthKeeping {
  std::string name() const override { return "doubled"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  Slope slope(int, int) const override { return Slope::Detached; }
  void launch(Launch& l) const override {
    const int count = static_cast<int>(l.in(0).shape.count());
    l.run("tensor/accumulate.cl", "accumulate", Range::of(static_cast<std::size_t>(count)), l.in(0), l.in(0), l.out(),
          count);
  }
};

TEST(Memory, OfWhatChunksKeepForTheirAdjointIsCounted) {
  Graph g;
  const Value x = g.input("x", {1, 3, 64, 64});
  const ChunkDomain domain{1, 64, 64, 1, 512, 1};
  const Value y = map_chunks(g, domain, std::span(&x, 1), [&](Graph& inner, std::span<const Value> in) {
    const Value tile = take_pixels(in[0], domain.chunk_pixels);
    return std::vector<ChunkOutput>{{multiply(tile, inner.make<DoubledOp>({tile}))}};
  })[0];
  // The loss reads y, which is therefore there before its adjoint in any case.
  const std::vector<Value> outputs{y, gradient(sum(multiply(y, y)), std::span(&x, 1))[0]};
  const std::map<std::string, Tensor> feeds{{"x", numbered(x.shape(), 5)}};
  const std::size_t kept = 3 * 64 * 64 * 4, again = allocated(g, outputs, feeds, {.keep = 0}, false);
  EXPECT_LE(allocated(g, outputs, feeds, {}, false), again + kept + 3 * 512 * 4);  // a chunk's part until it is copied
  EXPECT_EQ(allocated(g, outputs, feeds, {.keep = kept - 1}, false), again);
}

TEST(Memory, IsExplained) {
  const Branches net;
  const auto states = std::make_shared<States>(device());
  states->initialise(net.graph, 1);
  const std::size_t least = least_memory(net.graph, net.losses, device(), true);
  Executor run(compile(net.graph, net.losses, device(), {.budget = least}, true), states);
  const std::string text = run.explain();
  for (const char* word : {"order:", "recompute:", "arena:", "values", "bodies", "states", "predicted", "resident"})
    EXPECT_NE(text.find(word), std::string::npos) << word << " in\n" << text;
}

}  // namespace
}  // namespace clerestory
