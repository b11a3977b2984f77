// Means and statistics over the samples of a pixel, by sums in double.
#pragma once
#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory::accumulate_samples_reference {

inline constexpr int kPixels = 5, kSamples = 48, kCount = 60;

inline Tensors sums_inputs() {
  Tensors t{{"weight", random_tensor({1, 3, kPixels, kSamples}, 1, 0, 2)},
            {"radiance", random_tensor({1, 3, kPixels, kSamples}, 2, 0, 5)},
            {"pdf", random_tensor({1, 1, kPixels, kSamples}, 3, 0.1, 2)},
            {"u", random_tensor({1, 1, kPixels, kSamples}, 4, 0, 1)},
            {"hit", random_ints({1, 1, kPixels, kSamples}, 5, -1, 3)}};
  for (int s = 0; s < kSamples; s += 7) t["pdf"].at(0, 0, 2, s) = 0;
  return t;
}

inline std::vector<Tensor> sums_reference(const Tensors& t, bool traced) {
  Tensor mean(Shape{1, 3, kPixels, 1}), squares = mean, tally(Shape{1, 4, kPixels, 1}), first(Shape{1, 1, kPixels, 1});
  for (int p = 0; p < kPixels; ++p) {
    for (int c = 0; c < 3; ++c) {
      const auto x = [&](int s) {
        return t.at("pdf").at(0, 0, p, s) == 0 ? 0.0 : t.at("weight").at(0, c, p, s) * t.at("radiance").at(0, c, p, s);
      };
      double sum = 0;
      for (int s = 0; s < kSamples; ++s) sum += x(s);
      for (int s = 0; s < kSamples; ++s) squares.at(0, c, p, 0) += std::pow(x(s) - sum / kSamples, 2);
      mean.at(0, c, p, 0) = sum / kCount;
    }
    for (int s = 0; s < kSamples; ++s) {
      if (t.at("pdf").at(0, 0, p, s) == 0) continue;
      tally.at(0, 1, p, 0) += 1;
      if (!traced) continue;
      tally.at(0, 0, p, 0) += t.at("u").at(0, 0, p, s);
      tally.at(0, 3, p, 0) += t.at("hit").integer[static_cast<std::size_t>(p * kSamples + s)] >= 0;
    }
  }
  return {mean, squares, tally, first};
}

}  // namespace clerestory::accumulate_samples_reference
