// The in-view light's MLP in one kernel: against plain double arithmetic and against the ops that it puts together.
#include "host/ops/light/ask_mlp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/pixel_rows.hpp"
#include "host/ops/light/rescale_hits.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/encode.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/slice.hpp"
#include "tests/ops/light/listed_rays.hpp"

namespace clerestory {
namespace {

constexpr Shape kPicture{1, 1, 6, 8}, kCells{1, 1, 3, 4};

struct Mlp {
  int width = 32, layers = 3, waves = 8, again = 0;
  double gain = 1;  // of the hidden layers

  int channels() const { return again > 0 ? 2 * width : width; }
  bool reads(int layer) const { return layer == 0 || (again > 0 && layer == again); }
};

std::string hidden_name(int layer) { return fmt::format("hidden{}", layer); }
std::string direction_name(int layer) { return fmt::format("along{}", layer); }
std::string bias_name(int layer) { return fmt::format("bias{}", layer); }

Tensors mlp_inputs(const Mlp& m, int rows, int samples) {
  const Shape one{1, 1, rows, samples};
  Tensors t{{"surface", random_tensor({1, m.channels(), kPicture.h, kPicture.w}, 1)},
            {"features", random_tensor({1, m.channels(), kCells.h, kCells.w}, 2)},
            {"hit", random_ints(one, 3, -8, static_cast<int>(kPicture.plane()))},
            {"direction", random_tensor({1, 3, rows, samples}, 4)},
            {"frequencies", random_tensor({m.waves, 3, 1, 1}, 5, -3, 3)},
            {"out", random_tensor({3, m.width, 1, 1}, 6)},
            {"out_bias", random_tensor({1, 3, 1, 1}, 7)}};
  for (int& pixel : t["hit"].integer) pixel = std::max(pixel, -1);
  for (int layer = 0; layer < m.layers; ++layer) {
    const std::uint64_t seed = 10 + 3 * static_cast<std::uint64_t>(layer);
    const double size = m.gain * std::sqrt(6.0 / m.width);
    t[bias_name(layer)] = random_tensor({1, m.width, 1, 1}, seed, -0.3, 0.3);
    if (layer > 0) t[hidden_name(layer)] = random_tensor({m.width, m.width, 1, 1}, seed + 1, -size, size);
    if (m.reads(layer)) t[direction_name(layer)] = random_tensor({m.width, 2 * m.waves, 1, 1}, seed + 2, -0.5, 0.5);
  }
  return t;
}

/// A number and the deviation of its rounding errors, in epsilons: errors of single operations are as good as
/// independent, so their squares add up (Higham and Mary 2019, SIAM J. Sci. Comput. 41(5)). Bounds are kDeviations of
/// them.
struct Rounded {
  double value = 0, deviation = 0;
  /// One more term of a sum, which is rounded to half an epsilon of what it then is.
  void add(double term, double from) {
    value += term;
    deviation = std::sqrt(deviation * deviation + from * from + 0.25 * value * value);
  }
};
constexpr double kDeviations = 4;

void add_product(Rounded& sum, const Tensor& w, int row, const std::vector<Rounded>& x) {
  for (int k = 0; k < w.shape.c; ++k) {
    const double weight = w.at(row, k, 0, 0);
    sum.add(weight * x[static_cast<std::size_t>(k)].value, weight * x[static_cast<std::size_t>(k)].deviation);
  }
}

/// What a sine or cosine of up to 9 turns may lose, in epsilons: against exact arithmetic the rounding of the turns
/// too.
constexpr double kWaveAlone = 4, kWaveAndTurns = 2 * M_PI * 9 * 2 + kWaveAlone;

/// f of one ray.
std::vector<Rounded> answer_of_ray(const Mlp& m, const Tensors& t, int row, int sample, double wave) {
  const Tensor &hit = t.at("hit"), &surface = t.at("surface"), &features = t.at("features");
  const int pixel = hit.integer[static_cast<std::size_t>(row * hit.shape.w + sample)];
  if (pixel < 0) return std::vector<Rounded>(3);
  const int y = pixel / kPicture.w, x = pixel % kPicture.w;
  std::vector<Rounded> along(static_cast<std::size_t>(2 * m.waves));
  for (int j = 0; j < m.waves; ++j) {
    double turns = 0;
    for (int c = 0; c < 3; ++c) turns += t.at("frequencies").at(j, c, 0, 0) * t.at("direction").at(0, c, row, sample);
    const std::size_t at = static_cast<std::size_t>(j);
    along[at] = {std::sin(2 * M_PI * turns), wave};
    along[at + static_cast<std::size_t>(m.waves)] = {std::cos(2 * M_PI * turns), wave};
  }
  std::vector<Rounded> numbers;
  for (int layer = 0; layer < m.layers; ++layer) {
    std::vector<Rounded> next(static_cast<std::size_t>(m.width));
    for (int k = 0; k < m.width; ++k) {
      Rounded& sum = next[static_cast<std::size_t>(k)];
      if (m.reads(layer)) {
        const int c = k + (layer > 0 ? m.width : 0);
        sum.add(surface.at(0, c, y, x), 0);
        sum.add(features.at(0, c, y * kCells.h / kPicture.h, x * kCells.w / kPicture.w), 0);
        add_product(sum, t.at(direction_name(layer)), k, along);
      }
      sum.add(t.at(bias_name(layer)).at(0, k, 0, 0), 0);
      if (layer > 0) add_product(sum, t.at(hidden_name(layer)), k, numbers);
      sum.value = std::max(sum.value, 0.0);
    }
    numbers = next;
  }
  std::vector<Rounded> f(3);
  for (int c = 0; c < 3; ++c) {
    f[static_cast<std::size_t>(c)].add(t.at("out_bias").at(0, c, 0, 0), 0);
    add_product(f[static_cast<std::size_t>(c)], t.at("out"), c, numbers);
  }
  return f;
}

struct Answer {
  Tensor f;
  double roundings = 0;  // how far rounding may take the number that it harms most, in epsilons
};

/// `list` empty: all rays.
Answer plain_answer(const Mlp& m, const Tensors& t, const std::vector<int>& list, double wave = kWaveAndTurns) {
  const Shape& rays = t.at("direction").shape;
  Answer answer{Tensor(Shape{1, 3, rays.h, rays.w}), 0};
  for (int ray = 0; ray < rays.plane(); ++ray) {
    if (!list.empty() && std::find(list.begin(), list.end(), ray) == list.end()) continue;
    const std::vector<Rounded> f = answer_of_ray(m, t, ray / rays.w, ray % rays.w, wave);
    for (int c = 0; c < 3; ++c) {
      answer.f.at(0, c, ray / rays.w, ray % rays.w) = f[static_cast<std::size_t>(c)].value;
      answer.roundings = std::max(answer.roundings, kDeviations * f[static_cast<std::size_t>(c)].deviation);
    }
  }
  return answer;
}

Value ask(const Mlp& m, const Values& v, const RayList& list) {
  LightMlp net{v.at("frequencies"), {}, {}, {}, v.at("out"), v.at("out_bias"), m.again};
  for (int layer = 0; layer < m.layers; ++layer) {
    if (layer > 0) net.hidden.push_back(v.at(hidden_name(layer)));
    if (m.reads(layer)) net.direction.push_back(v.at(direction_name(layer)));
    net.biases.push_back(v.at(bias_name(layer)));
  }
  return ask_mlp(net, pixel_rows(v.at("surface"), v.at("features")), v.at("hit"), v.at("direction"), list);
}

OpCase mlp_case(const std::string& label, const Mlp& m, Tensors inputs, const std::vector<int>& list = {}) {
  OpCase c{.stem = "ask_mlp", .label = label, .kernels = {"pack_layer", "ask_mlp"}, .inputs = std::move(inputs)};
  const Shape rays = c.inputs.at("direction").shape;
  c.build = [=](Graph& g, const Values& v) {
    return std::vector{ask(m, v, list.empty() ? RayList{} : list_of(g, list, rays))};
  };
  c.reference = [=](const Tensors& t) { return std::vector{plain_answer(m, t, list).f}; };
  c.roundings = plain_answer(m, c.inputs, list).roundings, c.magnitude = 1;
  c.no_gradient = "for inference: throws";
  return c;
}

OP_CASES(ask_mlp) {
  const Mlp plain, again{.width = 48, .layers = 4, .waves = 5, .again = 2}, last{.layers = 3, .again = 2};
  const Mlp one{.layers = 1}, wide{.width = 512, .layers = 2, .waves = 3}, waves{.layers = 2, .waves = 256};
  const Mlp loud{.gain = 1e6}, silent{.gain = 0};
  Tensors misses = mlp_inputs(plain, 2, 16);
  for (int& pixel : misses["hit"].integer) pixel = -1;
  return {mlp_case("plain", plain, mlp_inputs(plain, 5, 32)),
          mlp_case("input_again", again, mlp_inputs(again, 3, 16)),
          mlp_case("input_again_last", last, mlp_inputs(last, 2, 16)),
          mlp_case("listed", plain, mlp_inputs(plain, 7, 16), every(3, 112)),
          mlp_case("one_ray", again, mlp_inputs(again, 2, 16), {17}),
          mlp_case("one_layer", one, mlp_inputs(one, 2, 16)),
          mlp_case("wide", wide, mlp_inputs(wide, 2, 16)),
          mlp_case("most_waves", waves, mlp_inputs(waves, 1, 16)),
          mlp_case("loud", loud, mlp_inputs(loud, 2, 16)),
          mlp_case("silent", silent, mlp_inputs(silent, 2, 16)),
          mlp_case("misses", plain, misses)};
}

/// The same numbers through memory, as nets/light_net.cpp puts them together; a miss gets those of no lookup.
Value composed(const Mlp& m, const Values& v) {
  const Value hit = v.at("hit");
  const Value looked_up =
      add(gather_rays(v.at("surface"), hit), gather_rays(v.at("features"), rescale_hits(hit, kPicture, kCells)));
  const Value along = encode(v.at("direction"), v.at("frequencies"));
  Value x;
  int read = 0;
  for (int layer = 0; layer < m.layers; ++layer) {
    const Value bias = v.at(bias_name(layer));
    Value y = layer == 0 ? Value{} : conv(x, v.at(hidden_name(layer)), m.reads(layer) ? Value{} : bias);
    if (m.reads(layer)) {
      const Value input =
          add(conv(along, v.at(direction_name(layer)), bias), slice(looked_up, m.width * read++, m.width));
      y = y ? add(y, input) : input;
    }
    x = relu(y);
  }
  return conv(x, v.at("out"), v.at("out_bias"));
}

/// A graph of inputs that is run on chunks of them.
TEST(AskMlp, IsGatherEncodeAndConv) {
  for (const Mlp& m : {Mlp{.width = 128, .layers = 4, .waves = 32}, Mlp{.width = 64, .layers = 9, .again = 5}}) {
    const Tensors inputs = mlp_inputs(m, 5, 48);
    Net net(inputs);
    const std::vector<Value> both{ask(m, net.values, {}), composed(m, net.values)};
    const double roundings = 2 * plain_answer(m, inputs, {}, kWaveAlone).roundings;  // each has its own
    for (const Precision precision : {Precision::Single, Precision::Double}) {
      const std::vector<Tensor> got = net.run(both, inputs, precision);
      const double epsilon = precision == Precision::Single ? 0x1p-23 : 0x1p-52;
      double worst = 0, largest = 0;
      for (int p = 0; p < 5; ++p)
        for (int s = 0; s < 48; ++s)
          for (int c = 0; c < 3; ++c) {
            if (inputs.at("hit").integer[static_cast<std::size_t>(p * 48 + s)] < 0) continue;
            worst = std::max(worst, std::abs(got[0].at(0, c, p, s) - got[1].at(0, c, p, s)));
            largest = std::max(largest, std::abs(got[1].at(0, c, p, s)));
          }
      EXPECT_GT(largest, 0.1);
      EXPECT_LE(worst, roundings * epsilon) << "of " << largest;
    }
  }
}

// Any list and any tile: the same bits for a ray.
TEST(AskMlp, ARayIsAskedAlone) {
  const Mlp m{.again = 1};
  const Tensors inputs = mlp_inputs(m, 6, 32);
  Net net(inputs);
  const Tensor all = net.run({ask(m, net.values, {})}, inputs, Precision::Single)[0];
  const Tensor some =
      net.run({ask(m, net.values, list_of(net.graph, every(5, 192), {1, 1, 6, 32}))}, inputs, Precision::Single)[0];
  for (int i = 0; i < 192; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(some.at(0, c, i / 32, i % 32), i % 5 == 1 ? all.at(0, c, i / 32, i % 32) : 0);

  Tensors part = inputs;  // rows 2 to 5, samples 16 to 31, in a tile with room for a row more
  part["direction"] = random_tensor({1, 3, 5, 16}, 9), part["hit"] = random_ints({1, 1, 5, 16}, 9, 0, 40);
  for (int p = 0; p < 4; ++p)
    for (int s = 0; s < 16; ++s) {
      for (int c = 0; c < 3; ++c) part["direction"].at(0, c, p, s) = inputs.at("direction").at(0, c, p + 2, s + 16);
      part["hit"].integer[static_cast<std::size_t>(p * 16 + s)] =
          inputs.at("hit").integer[static_cast<std::size_t>((p + 2) * 32 + s + 16)];
    }
  Net tile(part);
  const Tensor got = tile.run({ask(m, tile.values, {})}, part, Precision::Single, {2, 4, 16, 16})[0];
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < 5; ++p)
      for (int s = 0; s < 16; ++s) EXPECT_EQ(got.at(0, c, p, s), p < 4 ? all.at(0, c, p + 2, s + 16) : 0);
}

TEST(AskMlp, AnEmptyListGivesZeros) {
  const Mlp m;
  const Tensors inputs = mlp_inputs(m, 3, 16);
  Net net(inputs);
  const Tensor f = net.run({ask(m, net.values, list_of(net.graph, {}, {1, 1, 3, 16}))}, inputs, Precision::Single)[0];
  EXPECT_EQ(f.real, Tensor(f.shape).real);
}

TEST(AskMlp, ArgumentsAreChecked) {
  const Mlp m;
  Net net(mlp_inputs(m, 2, 16));
  const auto change = [&](const char* name, const Shape& shape) {
    Values changed = net.values;
    changed[name] = net.graph.fill(shape, 0);
    return changed;
  };
  EXPECT_NO_THROW(ask(m, net.values, {}));
  EXPECT_THROW(ask(m, change("hit", {1, 1, 2, 16}), {}), Error);  // not integers
  EXPECT_THROW(ask(m, change("direction", {1, 3, 3, 16}), {}), Error);
  EXPECT_THROW(ask(m, change("hidden1", {32, 31, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("along0", {24, 16, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("frequencies", {7, 3, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("out", {4, 32, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, change("bias1", {1, 16, 1, 1}), {}), Error);
  EXPECT_THROW(ask(m, net.values, list_of(net.graph, {}, {1, 1, 3, 16})), Error);
  Mlp reading = m;  // a layer that there is not
  reading.again = 3;
  EXPECT_THROW(ask(reading, net.values, {}), Error);
  const Value y = ask(m, net.values, {});
  EXPECT_THROW(gradient(std::vector{y}, std::vector{net.graph.fill(y.shape(), 1)}, std::vector{net.values.at("out")}),
               Error);
}

}  // namespace
}  // namespace clerestory
