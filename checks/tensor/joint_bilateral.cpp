#include "host/ops/tensor/joint_bilateral.hpp"

#include <algorithm>
#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

double gauss(double squared, double deviation) { return std::exp(-squared / (2 * deviation * deviation)); }

struct Tap {
  double weight;
  std::vector<double> value;  // of each channel
};

double squared_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t c = 0; c < a.size(); ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

std::vector<Tap> taps_of(const Tensors& in, int n, int j, int i, const JointBilateral& by) {
  const Tensor &x = in.at("x"), &low = in.at("low"), &guide = in.at("guide");
  const double v = (j + 0.5) * low.shape.h / guide.shape.h - 0.5, u = (i + 0.5) * low.shape.w / guide.shape.w - 0.5;
  std::vector<Tap> taps;
  for (int qy = static_cast<int>(std::floor(v)) - 1; qy <= std::floor(v) + 2; ++qy)
    for (int qx = static_cast<int>(std::floor(u)) - 1; qx <= std::floor(u) + 2; ++qx) {
      const int cy = std::clamp(qy, 0, low.shape.h - 1), cx = std::clamp(qx, 0, low.shape.w - 1);
      double unlike = 0;
      for (int c = 0; c < 3; ++c) unlike += std::pow(guide.at(n, c, j, i) - low.at(n, c, cy, cx), 2);
      Tap& tap = taps.emplace_back();
      tap.weight = gauss((v - qy) * (v - qy) + (u - qx) * (u - qx), by.reach) * (gauss(unlike, by.sigma) + 1.0 / 1024);
      for (int c = 0; c < x.shape.c; ++c) tap.value.push_back(x.at(n, c, cy, cx));
    }
  return taps;
}

/// Weights of the taps that are like the one which most agree with, the first of those within 1e-5.
void keep_mode(std::vector<Tap>& taps, double alike) {
  const auto agreed = [&](const Tap& with) {
    double sum = 0;
    for (const Tap& tap : taps) sum += tap.weight * gauss(squared_distance(with.value, tap.value), alike);
    return sum;
  };
  Tap mode;
  double most = -1;
  for (const Tap& tap : taps)
    if (const double sum = agreed(tap); sum > most * 1.00001) mode = tap, most = sum;
  for (Tap& tap : taps) tap.weight *= gauss(squared_distance(mode.value, tap.value), alike);
}

Tensor reference(const Tensors& in, const JointBilateral& by) {
  const Tensor &x = in.at("x"), &guide = in.at("guide");
  Tensor y({x.shape.n, x.shape.c, guide.shape.h, guide.shape.w});
  for (int n = 0; n < y.shape.n; ++n)
    for (int j = 0; j < y.shape.h; ++j)
      for (int i = 0; i < y.shape.w; ++i) {
        std::vector<Tap> taps = taps_of(in, n, j, i, by);
        if (by.alike > 0) keep_mode(taps, by.alike);
        double weights = 0;
        for (const Tap& tap : taps) weights += tap.weight;
        for (int c = 0; c < y.shape.c; ++c) {
          double sum = 0;
          for (const Tap& tap : taps) sum += tap.weight * tap.value[static_cast<std::size_t>(c)];
          y.at(n, c, j, i) = sum / weights;
        }
      }
  return y;
}

OpCase make_case(const std::string& label, Shape x, int h, int w, const JointBilateral& by, int padding = 0) {
  OpCase c;
  c.stem = "joint_bilateral", c.label = label;
  c.kernels = {by.alike > 0 ? "joint_bilateral_mode" : "joint_bilateral"};
  c.inputs = {{"x", random_tensor({x.n, x.c, x.h + padding, x.w + 2 * padding}, 1)},
              {"low", random_tensor({x.n, 3, x.h, x.w}, 2, 0, 1)},
              {"guide", random_tensor({x.n, 3, h, w}, 3, 0, 1)}};
  c.build = [by](Graph&, const Values& v) {
    return std::vector{joint_bilateral(v.at("x"), v.at("low"), v.at("guide"), by)};
  };
  c.reference = [by](const Tensors& in) { return std::vector{reference(in, by)}; };
  // An exponent is rounded to so many units as it is large, and so is each weight: of three channels that differ by at
  // most 1, of places that are at most 2 away in u and in v, of values that differ by at most 2 each.
  const auto largest = [](double squared, double deviation) { return squared / (2 * deviation * deviation); };
  c.roundings = 32 + largest(3, by.sigma) + largest(8, by.reach), c.magnitude = 1;
  if (by.alike > 0) c.roundings += 16 + largest(4 * x.c, by.alike);
  c.no_gradient = "it serves finished maps";
  return c;
}

}  // namespace

OP_CASES(joint_bilateral) {
  return {make_case("enlarges", {2, 3, 6, 8}, 15, 21, {.sigma = 0.1}),
          make_case("shrinks", {1, 1, 9, 7}, 4, 3, {.sigma = 0.3, .reach = 1}),
          make_case("one_pixel", {1, 2, 1, 1}, 3, 5, {.sigma = 0.1}),
          make_case("nothing_alike", {1, 2, 5, 5}, 11, 10, {.sigma = 0.005}),
          make_case("padded", {2, 2, 5, 6}, 9, 14, {.sigma = 0.2}, 3),
          make_case("mode", {2, 3, 6, 8}, 15, 21, {.sigma = 0.1, .alike = 0.3}),
          make_case("mode_of_what_is_all_alike", {1, 1, 5, 7}, 9, 6, {.sigma = 0.2, .reach = 1, .alike = 10}),
          make_case("mode_of_one_pixel", {1, 2, 1, 1}, 3, 5, {.alike = 0.3}),
          make_case("mode_of_what_nothing_is_like", {1, 3, 5, 5}, 11, 10, {.sigma = 0.3, .alike = 0.01}),
          make_case("mode_padded", {2, 2, 5, 6}, 9, 14, {.sigma = 0.2, .alike = 0.3}, 3)};
}

}  // namespace clerestory
