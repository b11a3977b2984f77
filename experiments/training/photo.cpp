#include "experiments/training/photo.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "experiments/training/keyed.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

enum Purpose : std::uint64_t {
  corner_draw = 31,
  focus_draw,
  exposure_draw,
  red_draw,
  blue_draw,
  shot_draw,
  read_draw,
  contrast_draw,
  gamma_draw,
  radius_draw,
  angle_draw,
  quality_draw
};

constexpr double kMostFallOff = 0.4;                      // of light in the corners
constexpr double kMostBlur = 0.8;                         // pixels of the nets' input
constexpr double kMostTint = 0.15;                        // ln of the gain of red and of blue
constexpr double kMostShotNoise = 2e-3;                   // variance over signal, white at 1
constexpr double kMostReadNoise = 1e-2;                   // standard deviation
constexpr double kMostContrast = 0.5;                     // part of the smooth step in the tone curve
constexpr double kMostGamma = 0.15;                       // |ln| of the exponent beside 1 / 2.2
constexpr double kLeastQuality = 50, kMostQuality = 100;  // of a JPEG of the nets' size
constexpr double kPhotoGamma = 2.2;                       // of pictures that are read

double between(double low, double high, std::uint64_t key, Purpose purpose) {
  return low + (high - low) * keyed_uniform(key, 0, purpose);
}

void darken_corners(Image& image, double most) {
  const double cx = 0.5 * image.width, cy = 0.5 * image.height, corner = cx * cx + cy * cy;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double dx = x + 0.5 - cx, dy = y + 0.5 - cy;
      const auto factor = static_cast<float>(1 - most * (dx * dx + dy * dy) / corner);
      for (int c = 0; c < image.channels; ++c) image.at(c, y, x) *= factor;
    }
}

/// Along rows, then along columns; beyond the border its last pixel.
Image blurred(const Image& image, double sigma) {
  constexpr int reach = 3;
  double weights[2 * reach + 1], sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += weights[k + reach] = std::exp(-0.5 * k * k / (sigma * sigma));
  Image rows = image, out = image;
  const auto pass = [&](const Image& from, Image& to, int step_x, int step_y) {
    for (int c = 0; c < from.channels; ++c)
      for (int y = 0; y < from.height; ++y)
        for (int x = 0; x < from.width; ++x) {
          double total = 0;
          for (int k = -reach; k <= reach; ++k)
            total += weights[k + reach] * from.at(c, std::clamp(y + k * step_y, 0, from.height - 1),
                                                  std::clamp(x + k * step_x, 0, from.width - 1));
          to.at(c, y, x) = static_cast<float>(total / sum);
        }
  };
  pass(image, rows, 1, 0);
  pass(rows, out, 0, 1);
  return out;
}

/// A standard normal number (Box and Muller 1958).
double normal_draw(std::uint64_t key, std::uint64_t i) {
  const double radius = std::sqrt(-2 * std::log1p(-keyed_uniform(key, i, radius_draw)));
  return radius * std::cos(2 * std::numbers::pi * keyed_uniform(key, i, angle_draw));
}

void add_noise(Image& image, std::uint64_t key) {
  const double shot = between(0, kMostShotNoise, key, shot_draw), read = between(0, kMostReadNoise, key, read_draw);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    const double v = static_cast<double>(image.data[i]);
    image.data[i] = static_cast<float>(v + std::sqrt(shot * v + read * read) * normal_draw(key, i));
  }
}

/// What a JPEG keeps of the tone curve in eight bits, read as the nets' pictures are.
void develop(Image& image, std::uint64_t key) {
  const double contrast = between(0, kMostContrast, key, contrast_draw);
  const double gamma = std::exp(between(-kMostGamma, kMostGamma, key, gamma_draw)) / kPhotoGamma;
  for (float& v : image.data) {
    const double encoded = std::pow(std::clamp(static_cast<double>(v), 0.0, 1.0), gamma);
    const double toned = encoded + contrast * (encoded * encoded * (3 - 2 * encoded) - encoded);
    v = static_cast<float>(toned);
  }
  const int quality = static_cast<int>(std::lround(between(kLeastQuality, kMostQuality, key, quality_draw)));
  image = decode_image(encode_jpeg(image, quality, Encoding::Linear, "photo.jpg"), "photo.jpg");
  for (float& v : image.data) v = static_cast<float>(std::pow(static_cast<double>(v), kPhotoGamma));
}

void scale(Image& image, double r, double g, double b) {
  const double gains[3] = {r, g, b};
  for (int c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < image.pixels(); ++i) image.plane(c)[i] *= static_cast<float>(gains[c]);
}

}  // namespace

Image as_photographed(const Image& linear, std::uint64_t key) {
  Image image = linear;
  darken_corners(image, between(0, kMostFallOff, key, corner_draw));
  if (const double sigma = between(0, kMostBlur, key, focus_draw); sigma > 0.2) image = blurred(image, sigma);
  // As often nearly everything below white as a tenth of it above.
  const double above = std::exp(between(std::log(1e-3), std::log(1e-1), key, exposure_draw));
  const double white = luminance_quantile(image.data, 1 - above);
  const double gain = white > 0 ? 1 / white : 1;
  const double red = std::exp(between(-kMostTint, kMostTint, key, red_draw));
  const double blue = std::exp(between(-kMostTint, kMostTint, key, blue_draw));
  scale(image, gain * red, gain, gain * blue);
  add_noise(image, key);
  develop(image, key);
  const double exposure = exposure_of(image.data);
  scale(image, exposure, exposure, exposure);
  return image;
}

}  // namespace clerestory
