// The radiance field in plain double arithmetic, with how far rounding may take it.
#pragma once
#include <algorithm>
#include <cmath>

#include "checks/op_case.hpp"
#include "host/ops/light/ask_field.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory::ask_field_reference {

inline constexpr double kOpaque = 14;

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

inline std::string weight_name(std::size_t i) { return fmt::format("w{}", i); }

inline std::string bias_name(std::size_t i) { return fmt::format("b{}", i); }

/// Weights as large as a net's, points in a room of a few metres, directions of any length.
inline Tensors field_inputs(const Field& f, int rows, int samples, bool point_per_row = false) {
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
inline constexpr double kDeviations = 4;

inline double root_of_squares(double a, double b) { return std::sqrt(a * a + b * b); }

/// What is uncertain before any sum: positions, in epsilons, and how much of an octave's angle 2^k x is rounded anew.
struct Uncertain {
  double position = 0, angle = 0;
};

/// Density and colour at a position. Each step of a sum is rounded to half an epsilon of what there is so far; sines
/// and cosines have up to 9 (kernels/light/ask_field.cl).
inline std::vector<Rounded> field_at(const Field& f, const Tensors& t, const double position[3], const Uncertain& u) {
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
inline std::array<Rounded, 3> light_of_ray(const Field& f, const Tensors& t, int row, int sample, const Uncertain& u) {
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
inline Answer plain_answer(const Field& f, const Tensors& t, const std::vector<int>& list, const Uncertain& u) {
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

inline Value ask(const Field& f, const Values& v, const RayList& list) {
  std::vector<Value> weights, biases;
  for (std::size_t i = 0; i < f.layers(); ++i)
    weights.push_back(v.at(weight_name(i))), biases.push_back(v.at(bias_name(i)));
  return ask_field(weights, biases, v.at("points"), v.at("direction"), v.at("range"), list, f.options,
                   f.background ? v.at("background") : Value{});
}

}  // namespace clerestory::ask_field_reference
