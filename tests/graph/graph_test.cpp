// The graph by itself: what compile() may share, what it must not, and that every pass leaves values as they are.
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <sstream>
#include <type_traits>

#include "host/graph/map_chunks.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/adam.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

Device& device() {
  static Device d = Device::open();
  return d;
}

Tensor random_tensor(Shape shape, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Tensor t(shape);
  for (double& x : t.real) x = uniform(generator);
  return t;
}

std::vector<PlanOptions> all_passes() {
  std::vector<PlanOptions> list;
  for (int i = 0; i < 16; ++i)
    list.push_back({.prune = (i & 1) != 0, .alias = (i & 2) != 0, .reuse = (i & 4) != 0, .reorder = (i & 8) != 0});
  return list;
}

/// A dense block of three layers, a skip link, and a value that is read again long after an in-place op wanted it.
Value dense(Value x) {
  Value all = x;
  for (int layer = 0; layer < 3; ++layer) {
    const Value made = relu(scale(slice(all, 0, 2), 0.5 + layer));
    all = concat(std::vector{all, made});
  }
  return concat(std::vector{slice(all, 1, 3), x, scale(all, 2)});
}

TEST(Compile, EveryPassLeavesValuesAsTheyAre) {
  Graph g;
  const Value x = g.input("x", {2, 4, 3, 5});
  const Value out = dense(x);
  const Value loss = sum(multiply(out, out));
  const Value dx = gradient(loss, std::span(&x, 1))[0];
  const std::map<std::string, Tensor> feeds{{"x", random_tensor(x.shape(), 1)}};
  const auto plain =
      evaluate(g, {out, loss, dx}, device(), feeds, {.prune = false, .alias = false, .reuse = false, .reorder = false});
  for (const PlanOptions& options : all_passes()) {
    const auto values = evaluate(g, {out, loss, dx}, device(), feeds, options);
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(values[i].real, plain[i].real);
  }
}

// A slice that begins where its whole does is read as often as the whole has channels.
TEST(Compile, NothingIsWrittenOverWhatASmallerViewStillReads) {
  Graph g;
  const Value x = g.input("x", {1, 3, 4, 5});
  const Value whole = scale(x, 2), product = multiply(whole, slice(whole, 0, 1));
  const std::map<std::string, Tensor> feeds{{"x", random_tensor(x.shape(), 1)}};
  const auto plain = evaluate(g, {product}, device(), feeds, {.alias = false});
  for (const PlanOptions& options : all_passes())
    EXPECT_EQ(evaluate(g, {product}, device(), feeds, options)[0].real, plain[0].real);
}

TEST(Compile, RefusesTensorsWithoutElementsOrOfTooMany) {
  Graph g;
  const auto of = [&](const Shape& shape) { return message_of<Error>([&] { g.input(shape.text(), shape); }); };
  EXPECT_NE(of({1, 0, 4, 4}).find("without elements"), std::string::npos);
  EXPECT_NE(of({1, -2, -3, 4}).find("without elements"), std::string::npos);
  EXPECT_NE(of({1, 3, 32768, 32768}).find("2^31"), std::string::npos);
}

TEST(Executor, FeedsNothingIntoWhatAnInputIsBoundTo) {
  Graph first, second;
  const Value y = scale(first.input("x", {1, 1, 2, 2}), 2), z = scale(second.input("y", {1, 1, 2, 2}), 3);
  Executor run(compile(first, {y}, device())), reader(compile(second, {z}, device()));
  run.feed("x", Tensor({1, 1, 2, 2}, 1));
  run.run();
  reader.bind("y", run.view(y));
  reader.feed("y", Tensor({1, 1, 2, 2}, 5));
  reader.run();
  EXPECT_EQ(reader.fetch(z).real, std::vector<double>(4, 15));
  EXPECT_EQ(run.fetch(y).real, std::vector<double>(4, 2));
}

TEST(Compile, AChainOfConcatenationsSharesOnePieceOfMemory) {
  Graph g;
  const Value x = relu(g.input("x", {1, 4, 8, 8}));
  Value all = x;
  for (int layer = 0; layer < 5; ++layer) all = concat(std::vector{all, relu(slice(all, 0, 2))});
  const Plan plan = compile(g, {all}, device());
  int root = -1;
  for (const Step& step : plan.steps) {
    if (root < 0) root = step.outputs[0].slot;
    EXPECT_EQ(step.outputs[0].slot, root) << step.node->op->name();
  }
  const std::size_t bytes = static_cast<std::size_t>(all.shape().count()) * 4;
  EXPECT_LT(plan.arena_bytes, bytes + 256);
}

TEST(Compile, AnInPlaceOpNeverTakesAValueThatIsReadLater) {
  Graph g;
  const Value x = g.input("x", {1, 2, 4, 4});
  const Value a = scale(x, -1);
  const Value b = relu(a);    // would like a's memory
  const Value c = add(b, a);  // but a is read here
  const Tensor input = random_tensor(x.shape(), 2);
  const auto values = evaluate(g, {c}, device(), {{"x", input}});
  for (std::size_t i = 0; i < input.real.size(); ++i) {
    const double v = -input.real[i];
    EXPECT_EQ(values[0].real[i], std::max(v, 0.0) + v);
  }
}

// Two views of one value that overlap: a sum in the place of the first would change the second before it is read.
TEST(Compile, AnInPlaceOpNeverWritesOverAnotherViewThatItReads) {
  Graph g;
  const Value x = g.input("x", {1, 3, 16, 16}), v = scale(x, 2);
  const Value sum = accumulate(slice(v, 1, 2), slice(v, 0, 2));
  const Tensor input = random_tensor(x.shape(), 2);
  const auto values = evaluate(g, {sum}, device(), {{"x", input}}, {.precision = Precision::Double});
  for (std::size_t i = 0; i < 2 * 256; ++i)
    EXPECT_EQ(values[0].real[i], 2 * input.real[i + 256] + 2 * input.real[i]) << i;
}

// What was written into a concatenation lies apart, picture from picture: no view makes one of them.
TEST(Compile, PicturesThatLieApartAreNotSeenAsOne) {
  Graph g;
  const Value x = g.input("x", {2, 3, 4, 4}), a = scale(x, 2), both = concat(std::vector{a, scale(x, 3)});
  const Value one = reshape(a, {1, 6, 4, 4});
  const Tensor input = random_tensor(x.shape(), 2);
  const auto values = evaluate(g, {both, one}, device(), {{"x", input}}, {.precision = Precision::Double});
  for (std::size_t i = 0; i < input.real.size(); ++i) EXPECT_EQ(values[1].real[i], 2 * input.real[i]) << i;
}

TEST(Compile, ReuseNeedsLessMemoryThanKeepingEverything) {
  Graph g;
  Value x = g.input("x", {1, 8, 16, 16});
  for (int i = 0; i < 10; ++i) x = add(multiply(x, x), x);
  EXPECT_LT(compile(g, {x}, device()).arena_bytes,
            compile(g, {x}, device(), {.alias = false, .reuse = false}).arena_bytes / 3);
}

TEST(Compile, PrunesWhatNoOutputNeeds) {
  Graph g;
  const Value x = g.input("x", {1, 1, 2, 2});
  scale(x, 3);
  const Value y = scale(x, 2);
  EXPECT_EQ(compile(g, {y}, device()).steps.size(), 1u);
  EXPECT_EQ(compile(g, {y}, device(), {.prune = false}).steps.size(), 2u);
}

TEST(Gradient, AddsUpOverConsumersAndSkipsWhatDoesNotDepend) {
  Graph g;
  const Value x = g.input("x", {1, 1, 1, 3}), y = g.input("y", {1, 1, 1, 3});
  const Value loss = sum(add(multiply(x, x), scale(x, 3)));
  const std::vector<Value> wrt{x, y};
  const std::vector<Value> grads = gradient(loss, wrt);
  EXPECT_FALSE(grads[1]);
  const auto values = evaluate(g, {grads[0]}, device(), {{"x", Tensor({1, 1, 1, 3}, std::vector<double>{1, -2, 0.5})}});
  EXPECT_EQ(values[0].real, (std::vector<double>{5, -1, 4}));
}

TEST(Gradient, WantsOneNumber) {
  Graph g;
  const Value x = g.input("x", {1, 1, 1, 3});
  EXPECT_THROW(gradient(x, std::span(&x, 1)), Error);
}

/// Says nothing about gradients.
struct SilentOp : Op {
  std::string name() const override { return "silent"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  void launch(Launch&) const override {}
};

TEST(Gradient, AnOpThatSaysNothingAboutGradientsDoesNotCompile) { EXPECT_TRUE(std::is_abstract_v<SilentOp>); }

TEST(Gradient, ThroughAnOpThatIsNotDifferentiableIsAnErrorThatNamesOpAndValue) {
  Graph g;
  const Value w = g.state("wanted", {1, 1, 4, 4}, Init::constant(1)), x = g.input("photo", {1, 1, 4, 4});
  const Value loss = sum(resize_area(multiply(x, w), 2, 2));
  for (const auto& [value, name] : {std::pair{w, "wanted"}, {x, "photo"}}) {
    const std::string said = message_of<Error>([&, v = value] { gradient(loss, std::span(&v, 1)); });
    EXPECT_NE(said.find("resize_area"), std::string::npos) << said;
    EXPECT_NE(said.find(name), std::string::npos) << said;
  }
  // Beside the path, or behind a detach, it is in nobody's way.
  const Value y = g.input("y", {1, 1, 2, 2});
  const Value beside = add(sum(multiply(y, resize_area(x, 2, 2))), sum(multiply(y, resize_area(detach(w), 2, 2))));
  const std::vector<Value> wrt{y, w};
  const std::vector<Value> found = gradient(beside, wrt);
  EXPECT_TRUE(found[0]);
  EXPECT_FALSE(found[1]);
}

TEST(Gradient, OfAGradientIsRefused) {
  Graph g;
  const Value x = g.input("x", {1, 1, 2, 2});
  const Value slope = gradient(sum(activate(x, Function::Exp)), std::span(&x, 1))[0];
  EXPECT_THROW(gradient(sum(slope), std::span(&x, 1)), Error);
}

TEST(Gradient, AParameterWithoutOneIsNotLeftAsItIsInSilence) {
  Graph g;
  const Value moved = g.state("moved", {1, 1, 1, 2}, Init::constant(1));
  const Value still = g.state("decoder.weight", {1, 1, 1, 2}, Init::constant(1));
  const std::vector<Value> parameters{moved, still};
  const std::vector<Value> gradients = gradient(sum(moved), parameters);
  const std::string said = message_of<Error>([&] { adam(parameters, gradients, g.fill({}, 1e-2), g.fill({}, 1)); });
  EXPECT_NE(said.find("decoder.weight"), std::string::npos) << said;
}

TEST(States, StartFromNameAndSeedAlone) {
  Graph g1, g2;
  g1.state("a", {1, 1, 1, 64}, Init::normal(2)), g1.state("b", {1, 1, 1, 8}, Init::uniform(1));
  g2.state("b", {1, 1, 1, 8}, Init::uniform(1)), g2.state("a", {1, 1, 1, 64}, Init::normal(2));
  States s1(device()), s2(device()), other(device());
  s1.initialise(g1, 7), s2.initialise(g2, 7), other.initialise(g1, 8);
  EXPECT_EQ(s1.get("a").real, s2.get("a").real);
  EXPECT_EQ(s1.get("b").real, s2.get("b").real);
  EXPECT_NE(s1.get("a").real, other.get("a").real);
  // Whatever the compiler: two draws of SplitMix64 by Box and Muller, times the deviation.
  EXPECT_NEAR(s1.get("a").real[0], -3.348647401, 1e-6);
  EXPECT_NEAR(s1.get("a").real[1], 3.144673515, 1e-6);
  EXPECT_THROW(s1.set("a", Tensor({1, 1, 1, 3})), Error);
  EXPECT_THROW(s1.get("c"), Error);
  EXPECT_THROW(g1.state("a", {1, 1, 1, 3}, Init::constant(0)), Error);
}

TEST(Executor, NamesTheInputThatWasNotFed) {
  Graph g;
  const Value y = scale(g.input("photo", {1, 1, 1, 1}), 2);
  Executor run(compile(g, {y}, device()));
  try {
    run.run();
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("photo"), std::string::npos);
  }
  EXPECT_THROW(run.feed("photo", Tensor({1, 1, 1, 2})), Error);
  EXPECT_THROW(run.feed("phot", Tensor({1, 1, 1, 1})), Error);
}

TEST(Executor, ExplainsWhatRuns) {
  Graph g;
  g.left_out("the mirror: nobody looks");
  const Value y = relu(g.input("x", {1, 1, 4, 4}));
  Executor run(compile(g, {y}, device()));
  run.feed("x", Tensor({1, 1, 4, 4}, 1));
  const std::string text = run.explain(true);
  EXPECT_NE(text.find("activ"), std::string::npos) << text;
  EXPECT_NE(text.find("the mirror: nobody looks"), std::string::npos);
}

/// y = (2 x)^2 at every pixel of a chunk, x * samples as a total.
std::vector<Value> chunked(Graph& g, Value x, const ChunkDomain& domain) {
  return map_chunks(g, domain, std::span(&x, 1), [=](Graph&, std::span<const Value> in) {
    const Value tile = scale(take_pixels(in[0], domain.chunk_pixels), 2);
    return std::vector<ChunkOutput>{{multiply(tile, tile), false}, {sum(tile), true}};
  });
}

TEST(MapChunks, CoversEveryPixelOnceWhateverTheChunk) {
  const Tensor input = random_tensor({2, 3, 5, 7}, 3);
  double total = 0, size = 0;
  for (const double v : input.real) total += 2 * v, size += 2 * std::abs(v);
  for (const int chunk_pixels : {1, 4, 8, 35, 64, 70, 100}) {
    for (const auto& [samples, chunk_samples] : {std::pair{1, 1}, {3, 1}, {3, 2}}) {
      Graph g;
      const Value x = g.input("x", input.shape);
      const ChunkDomain domain{2, 5, 7, samples, chunk_pixels, chunk_samples};
      const std::vector<Value> out = chunked(g, x, domain);
      ASSERT_EQ(out[0].shape(), input.shape);
      const auto values = evaluate(g, out, device(), {{"x", input}}, {.precision = Precision::Double});
      const int passes = (samples + chunk_samples - 1) / chunk_samples;  // this body does not look at samples
      for (std::size_t i = 0; i < input.real.size(); ++i)
        EXPECT_DOUBLE_EQ(values[0].real[i], passes * 4 * input.real[i] * input.real[i]);
      EXPECT_NEAR(values[1].real[0], passes * total, 2 * 210 * passes * kDoubleRounding * size);  // 210 terms, twice
    }
  }
}

TEST(MapChunks, TotalsGoToAPartOfSomethingLarger) {
  const Tensor input = random_tensor({2, 6, 2, 5}, 3);
  Graph g;
  const Value x = g.input("x", input.shape), t = scale(x, 2);
  const std::vector<Value> halves{slice(t, 0, 3), slice(t, 3, 3)};
  const Value y = map_chunks(g, {2, 2, 5, 1, 4, 1}, halves, [](Graph&, std::span<const Value> in) {
    const Value a = take_pixels(in[0], 4), b = take_pixels(in[1], 4);
    return std::vector<ChunkOutput>{{multiply(a, multiply(b, b)), false}};
  })[0];
  const Value dx = gradient(sum(y), std::span(&x, 1))[0];
  const auto values = evaluate(g, {dx}, device(), {{"x", input}}, {.precision = Precision::Double});
  for (int n = 0; n < 2; ++n)
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < 10; ++p) {
        const double a = 2 * input.at(n, c, p / 5, p % 5), b = 2 * input.at(n, c + 3, p / 5, p % 5);
        EXPECT_NEAR(values[0].at(n, c, p / 5, p % 5), 2 * b * b, 16 * kDoubleRounding * 8);
        EXPECT_NEAR(values[0].at(n, c + 3, p / 5, p % 5), 4 * a * b, 16 * kDoubleRounding * 8);
      }
}

TEST(MapChunks, ABodyRegroupsAPartOfOneItem) {
  const Tensor input = random_tensor({1, 6, 2, 2}, 3);
  Graph g;
  const Value x = g.input("x", input.shape), part = slice(scale(x, 2), 0, 3);
  const Value y = map_chunks(g, {1, 2, 2, 1, 4, 1}, std::span(&part, 1), [](Graph&, std::span<const Value> in) {
    return std::vector<ChunkOutput>{{sum(reshape(in[0], {3, 1, 2, 2})), true}};
  })[0];
  const auto values = evaluate(g, {y}, device(), {{"x", input}}, {.precision = Precision::Double});
  double total = 0;
  for (int i = 0; i < 12; ++i) total += 2 * input.real[static_cast<std::size_t>(i)];
  EXPECT_NEAR(values[0].real[0], total, 12 * 24 * kDoubleRounding);
}

TEST(MapChunks, SaysHowManyAreDone) {
  const Tensor input = random_tensor({2, 3, 5, 7}, 3);
  Graph g;
  const Value x = g.input("x", input.shape);
  const std::vector<Value> out = chunked(g, x, {2, 5, 7, 3, 32, 2});  // 70 pixels by 32, 3 samples by 2
  Executor run(compile(g, out, device()));
  run.feed("x", input);
  run.run();
  const Tensor alone = run.fetch(out[0]);
  std::vector<std::pair<int, int>> heard;
  run.after_chunk([&](int done, int chunks) { heard.emplace_back(done, chunks); });
  run.run();
  EXPECT_EQ(run.fetch(out[0]).real, alone.real);
  EXPECT_EQ(heard, (std::vector<std::pair<int, int>>{{1, 6}, {2, 6}, {3, 6}, {4, 6}, {5, 6}, {6, 6}}));
  run.after_chunk([](int done, int) {
    if (done == 2) throw Error(ErrorKind::Interrupted, "stopped");
  });
  EXPECT_THROW(run.run(), Error);
  run.after_chunk({});
  run.run();  // goes on as before
  EXPECT_EQ(run.fetch(out[0]).real, alone.real);
}

TEST(MapChunks, ItsAdjointReplaysTheChunks) {
  const Tensor input = random_tensor({2, 3, 5, 7}, 4), weight = random_tensor({2, 3, 5, 7}, 5);
  Graph g;
  const Value x = g.input("x", input.shape), w = g.input("w", input.shape);
  const std::vector<Value> out = chunked(g, x, {2, 5, 7, 1, 8, 1});
  const Value loss = add(sum(multiply(out[0], w)), out[1], 3);
  const Value dx = gradient(loss, std::span(&x, 1))[0];
  const auto values = evaluate(g, {dx}, device(), {{"x", input}, {"w", weight}}, {.precision = Precision::Double});
  for (std::size_t i = 0; i < input.real.size(); ++i)
    EXPECT_NEAR(values[0].real[i], 8 * input.real[i] * weight.real[i] + 6, 8 * kDoubleRounding * 14);
}

TEST(MapChunks, StatesOfABodyAreTheOuterGraphs) {
  const Tensor input = random_tensor({1, 3, 5, 7}, 6), weight = random_tensor({1, 3, 5, 7}, 7);
  const Tensor gain = random_tensor({1, 3, 1, 1}, 8);
  Graph g;
  const Value x = g.input("x", input.shape), w = g.input("w", input.shape);
  const Init init = Init::constant(1);
  const auto body = [&](Graph& inner, std::span<const Value> in) {
    return std::vector<ChunkOutput>{{multiply(take_pixels(in[0], 8), inner.state("gain", gain.shape, init)), false}};
  };
  const Value scaled = map_chunks(g, {1, 5, 7, 1, 8, 1}, std::span(&x, 1), body)[0];
  ASSERT_EQ(g.states().size(), 1u);
  const Value state = g.state("gain", gain.shape, init);  // the same one, that a node outside reads too
  const Value loss = sum(multiply(add(scaled, multiply(x, state), 0.5), w));
  const std::vector<Value> gradients = gradient(loss, std::array{x, state});
  const auto states = std::make_shared<States>(device(), Precision::Double);
  states->set("gain", gain);
  const auto values = evaluate(g, {scaled, gradients[0], gradients[1]}, device(), {{"x", input}, {"w", weight}},
                               {.precision = Precision::Double}, 0, states);
  std::array<double, 3> sums{};
  for (std::size_t i = 0; i < input.real.size(); ++i) {
    const std::size_t c = i / 35;
    EXPECT_DOUBLE_EQ(values[0].real[i], input.real[i] * gain.real[c]);
    EXPECT_NEAR(values[1].real[i], 1.5 * gain.real[c] * weight.real[i], 4 * kDoubleRounding * 1.5);
    sums[c] += 1.5 * input.real[i] * weight.real[i];
  }
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(values[2].real[c], sums[c], 2 * 35 * 35 * 1.5 * kDoubleRounding);  // 35 terms below 1.5, twice

  // What somebody sets between two runs is what the next one reads.
  Executor run(compile(g, {scaled}, device(), {.precision = Precision::Double}), states);
  run.feed("x", input), run.feed("w", weight);
  run.run();
  states->set("gain", Tensor(gain.shape, 3));
  run.run();
  EXPECT_DOUBLE_EQ(run.fetch(scaled).real[0], 3 * input.real[0]);
}

/// A convolution inside a body, over 16 columns of 1.
Value convolved(Graph& g, Value x) {
  const ChunkDomain domain{1, 4, 16, 1, 16, 1};
  return map_chunks(g, domain, std::span(&x, 1), [=](Graph& inner, std::span<const Value> in) {
    const Value w = inner.constant(random_tensor({5, 3, 3, 3}, 9));
    return std::vector<ChunkOutput>{{conv(take_pixels(in[0], domain.chunk_pixels), w, {}, {.pad = 1}), false}};
  })[0];
}

std::string kernels_of(Device d, const std::function<void()>& work) {
  d.set_profiling(true);
  d.reset_profile();
  work();
  std::string names;
  for (const KernelProfile& k : d.profile()) names += k.kernel + " ";
  d.set_profiling(false);
  return names;
}

TEST(MapChunks, ABodyRunsWithTheGemmOfEachPlan) {
  Graph g;
  const Tensor input = random_tensor({1, 3, 4, 16}, 8);
  const Value y = convolved(g, g.input("x", input.shape));
  std::map<std::string, std::string> kernels;
  for (const char* gemm : {"packed", "clblast"})
    kernels[gemm] = kernels_of(device(), [&] { evaluate(g, {y}, device(), {{"x", input}}, {.gemm = gemm}); });
  EXPECT_NE(kernels["packed"].find("conv"), std::string::npos) << kernels["packed"];
  EXPECT_NE(kernels["clblast"].find("im2col"), std::string::npos) << kernels["clblast"];
  EXPECT_EQ(kernels["packed"].find("im2col"), std::string::npos) << kernels["packed"];
}

TEST(MapChunks, ABodyRunsOnTheDeviceOfEachPlan) {
  Graph g;
  const Tensor input = random_tensor({1, 3, 4, 16}, 8);
  const Value y = convolved(g, g.input("x", input.shape));
  const auto one = evaluate(g, {y}, device(), {{"x", input}});
  Device other = Device::open();  // a context of its own: buffers of one are nothing to the other
  std::vector<Tensor> two;
  const std::string kernels = kernels_of(other, [&] { two = evaluate(g, {y}, other, {{"x", input}}); });
  EXPECT_EQ(one[0].real, two[0].real);
  EXPECT_NE(kernels.find("conv"), std::string::npos) << kernels;
}

/// GFLOP and MB of a row of explain().
std::pair<double, double> explained(const std::string& text, const std::string& op) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    double steps = 0, gflop = 0, mb = 0;
    if (words >> name >> steps >> gflop >> mb && name == op) return {gflop, mb};
  }
  ADD_FAILURE() << "no row of " << op << " in\n" << text;
  return {};
}

TEST(MapChunks, ExplainsWhatItsChunksDo) {
  const Shape whole{1, 64, 64, 256};
  const auto layer = [](Graph& g, Value x) { return conv(x, g.constant(random_tensor({64, 64, 1, 1}, 9)), {}); };
  Graph unchunked, chunked;
  const Value direct = layer(unchunked, unchunked.input("x", {1, 64, 64 * 256, 1}));
  const Value x = chunked.input("x", whole);
  const ChunkDomain domain{1, whole.h, whole.w, 1, 1024, 1};  // 16 chunks
  const Value tiled = map_chunks(chunked, domain, std::span(&x, 1), [&](Graph& g, std::span<const Value> in) {
    return std::vector<ChunkOutput>{{layer(g, take_pixels(in[0], domain.chunk_pixels)), false}};
  })[0];
  Executor one(compile(unchunked, {direct}, device())), many(compile(chunked, {tiled}, device()));
  const auto a = explained(one.explain(), "conv"), b = explained(many.explain(), "conv");
  EXPECT_NEAR(a.first, 2e-9 * 64 * 64 * 64 * 256, 5e-4);  // rounded to three digits
  EXPECT_DOUBLE_EQ(b.first, a.first);
  // What a chunk reads and writes is its part; the weights are read by each chunk again.
  EXPECT_NEAR(b.second, a.second + 15 * 64 * 64 * 4e-6, 2 * 0.005);  // both are shown to two decimals
  EXPECT_GT(explained(many.explain(), "total").first, 0.13);
  // The output and a chunk's own arena: its input and its output.
  const std::size_t output = static_cast<std::size_t>(whole.count()) * 4, part = output / 16;
  const std::size_t weights = 64 * 64 * 4;
  EXPECT_GE(many.bytes(), output + 2 * part + weights);
  EXPECT_LT(many.bytes(), output + 3 * part + weights);
}

/// Claims to write its input, a state.
struct WriteOp : NotDifferentiable {
  std::string name() const override { return "write"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape()}}; }
  void launch(Launch&) const override {}
  std::vector<int> writes() const override { return {0}; }
};

TEST(MapChunks, RefusesABodyThatUpdatesAState) {
  Graph g;
  const Value x = g.input("x", {1, 1, 2, 2});
  const auto body = [](Graph& inner, std::span<const Value> in) {
    inner.make<WriteOp>({inner.state("s", {}, Init::fixed(0))});
    return std::vector<ChunkOutput>{{take_pixels(in[0], 4), false}};
  };
  EXPECT_THROW(map_chunks(g, {1, 2, 2, 1, 4, 1}, std::span(&x, 1), body), Error);
}

TEST(MapChunks, RefusesAStatesGradientFromRaysOfALastChunkThatIsNotFull) {
  const auto gradient_with = [](int chunk_pixels, int samples) {
    Graph g;
    const Value x = g.input("x", {1, 1, 5, 7});
    const auto body = [=](Graph& inner, std::span<const Value> in) {
      const Value rays = inner.constant(Tensor({1, 1, chunk_pixels, 4}, 1));
      const Value asked = multiply(rays, inner.state("gain", {1, 1, 1, 1}, Init::constant(1)));
      return std::vector<ChunkOutput>{{sum(asked), true}, {take_pixels(in[0], chunk_pixels), false}};
    };
    const Value total = map_chunks(g, {1, 5, 7, samples, chunk_pixels, 4}, std::span(&x, 1), body)[0];
    const Value state = g.state("gain", {1, 1, 1, 1}, Init::constant(1));
    return message_of<Error>([&] { gradient(total, std::span(&state, 1)); });
  };
  EXPECT_NE(gradient_with(8, 4).find("last chunk that is not full"), std::string::npos);
  EXPECT_NE(gradient_with(7, 6).find("last chunk that is not full"), std::string::npos) << "the second has two samples";
  EXPECT_EQ(gradient_with(7, 4), "");
  EXPECT_EQ(gradient_with(7, 8), "");
}

TEST(States, OfAnotherShapeAreRefused) {
  Graph g;
  const Value w = g.state("w", {1, 1, 1, 1000}, Init::constant(0)), y = scale(w, 2);
  const auto states = std::make_shared<States>(device());
  states->set("w", Tensor({1, 1, 1, 3}, 1));
  EXPECT_NE(message_of<Error>([&] { states->initialise(g, 1); }).find("another shape"), std::string::npos);
  EXPECT_NE(message_of<Error>([&] { Executor(compile(g, {y}, device()), states); }).find("another shape"),
            std::string::npos);
  EXPECT_NE(message_of<Error>([&] { state_of(y); }).find("is no state"), std::string::npos);
}

TEST(MapChunks, RefusesAnEmptyDomain) {
  Graph g;
  const Value x = g.input("x", {1, 1, 2, 2});
  EXPECT_THROW(chunked(g, x, {1, 0, 2, 1, 8, 1}), Error);
}

}  // namespace
}  // namespace clerestory
