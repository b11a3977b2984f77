// The in-view light's MLP in plain double arithmetic, with how far rounding may take it.
#pragma once
#include <algorithm>
#include <cmath>

#include "checks/op_case.hpp"
#include "host/ops/light/ask_mlp.hpp"
#include "host/ops/light/pixel_rows.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory::ask_mlp_reference {

inline constexpr Shape kPicture{1, 1, 6, 8}, kCells{1, 1, 3, 4};

struct Mlp {
  int width = 32, layers = 3, waves = 8, again = 0;
  double gain = 1;  // of the hidden layers

  int channels() const { return again > 0 ? 2 * width : width; }
  bool reads(int layer) const { return layer == 0 || (again > 0 && layer == again); }
};

inline std::string hidden_name(int layer) { return fmt::format("hidden{}", layer); }

inline std::string direction_name(int layer) { return fmt::format("along{}", layer); }

inline std::string bias_name(int layer) { return fmt::format("bias{}", layer); }

inline Tensors mlp_inputs(const Mlp& m, int rows, int samples) {
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

/// mlp_inputs() with what a ray looks up and encodes given.
inline Tensors ray_inputs(const Mlp& m, int rows, int samples) {
  Tensors t = mlp_inputs(m, rows, samples);
  for (const char* name : {"surface", "features", "hit", "direction", "frequencies"}) t.erase(name);
  t["input"] = random_tensor({1, m.channels(), rows, samples}, 1);
  t["encoded"] = random_tensor({1, 2 * m.waves, rows, samples}, 2);
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
inline constexpr double kDeviations = 4;

inline void add_product(Rounded& sum, const Tensor& w, int row, const std::vector<Rounded>& x) {
  for (int k = 0; k < w.shape.c; ++k) {
    const double weight = w.at(row, k, 0, 0);
    sum.add(weight * x[static_cast<std::size_t>(k)].value, weight * x[static_cast<std::size_t>(k)].deviation);
  }
}

/// What a sine or cosine of up to 9 turns may lose, in epsilons: against exact arithmetic the rounding of the turns
/// too.
inline constexpr double kWaveAlone = 4, kWaveAndTurns = 2 * M_PI * 9 * 2 + kWaveAlone;

/// f of one ray.
inline std::vector<Rounded> answer_of_ray(const Mlp& m, const Tensors& t, int row, int sample, double wave) {
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
inline Answer plain_answer(const Mlp& m, const Tensors& t, const std::vector<int>& list, double wave = kWaveAndTurns) {
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

inline LightMlp net_of(const Mlp& m, const Values& v) {
  LightMlp net{{}, {}, {}, v.at("out"), v.at("out_bias"), m.again};
  for (int layer = 0; layer < m.layers; ++layer) {
    if (layer > 0) net.hidden.push_back(v.at(hidden_name(layer)));
    if (m.reads(layer)) net.direction.push_back(v.at(direction_name(layer)));
    net.biases.push_back(v.at(bias_name(layer)));
  }
  return net;
}

inline Value ask(const Mlp& m, const Values& v, const RayList& list) {
  return ask_mlp(net_of(m, v), v.at("frequencies"), pixel_rows(v.at("surface"), v.at("features")), v.at("hit"),
                 v.at("direction"), list);
}

}  // namespace clerestory::ask_mlp_reference
