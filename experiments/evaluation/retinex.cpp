#include "experiments/evaluation/retinex.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/evaluation/gradients.hpp"

namespace clerestory {
namespace {

constexpr double kDarkest = 1.0 / 255;

struct LogPicture {
  std::vector<double> intensity;              // mean over channels
  std::array<std::vector<double>, 3> chroma;  // the rest
};

LogPicture logarithms(const Image& picture) {
  LogPicture logs;
  for (std::size_t i = 0; i < picture.pixels(); ++i) {
    std::array<double, 3> l{};
    for (int c = 0; c < 3; ++c)
      l[static_cast<std::size_t>(c)] = std::log(std::clamp(static_cast<double>(picture.plane(c)[i]), kDarkest, 1.0));
    logs.intensity.push_back((l[0] + l[1] + l[2]) / 3);
    for (std::size_t c = 0; c < 3; ++c) logs.chroma[c].push_back(l[c] - logs.intensity.back());
  }
  return logs;
}

/// Those of `intensity` that are changes of albedo, 0 in the place of others.
void keep_albedo(std::vector<double>& intensity, const std::array<const std::vector<double>*, 3>& chroma,
                 const RetinexThresholds& thresholds) {
  for (std::size_t i = 0; i < intensity.size(); ++i) {
    const double change = std::hypot((*chroma[0])[i], (*chroma[1])[i], (*chroma[2])[i]);
    if (std::abs(intensity[i]) <= thresholds.intensity && change <= thresholds.chroma) intensity[i] = 0;
  }
}

}  // namespace

Image retinex_albedo(const Image& picture, const RetinexThresholds& thresholds) {
  const int w = picture.width, h = picture.height;
  const LogPicture logs = logarithms(picture);
  GridGradients kept = gradients_of(logs.intensity, w, h);
  std::array<GridGradients, 3> chroma;
  for (std::size_t c = 0; c < 3; ++c) chroma[c] = gradients_of(logs.chroma[c], w, h);
  keep_albedo(kept.right, {&chroma[0].right, &chroma[1].right, &chroma[2].right}, thresholds);
  keep_albedo(kept.down, {&chroma[0].down, &chroma[1].down, &chroma[2].down}, thresholds);
  const std::vector<double> reflectance = integrated(kept);
  Image albedo(w, h, 3);
  double brightest = 0;
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < albedo.pixels(); ++i) {
      const double value = std::exp(reflectance[i] + logs.chroma[static_cast<std::size_t>(c)][i]);
      albedo.plane(c)[i] = static_cast<float>(value);
      brightest = std::max(brightest, value);
    }
  scale(albedo.data, static_cast<float>(1 / brightest));
  return albedo;
}

}  // namespace clerestory
