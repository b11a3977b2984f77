#include "host/io/resize.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"

namespace clerestory {
namespace {

/// Weights of the old pixels first, first + 1, ... in one new pixel.
struct Taps {
  int first = 0;
  std::vector<double> weights;
};

enum class Shrink { Average, Interpolate };

std::vector<Taps> taps_of(int from, int to, Shrink how) {
  std::vector<Taps> taps(static_cast<std::size_t>(to));
  const double ratio = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    Taps& t = taps[static_cast<std::size_t>(i)];
    if (ratio > 1 && how == Shrink::Average) {  // covered areas
      const double begin = i * ratio, end = (i + 1) * ratio;
      t.first = static_cast<int>(begin);
      const int last = std::min(from, static_cast<int>(std::ceil(end - 1e-9)));
      for (int j = t.first; j < last; ++j)
        t.weights.push_back((std::min<double>(end, j + 1) - std::max<double>(begin, j)) / ratio);
    } else {  // linear between centres, clamped at the border
      const double at = std::clamp((i + 0.5) * ratio - 0.5, 0.0, from - 1.0);
      t.first = std::min(static_cast<int>(at), std::max(0, from - 2));
      t.weights = {1 - (at - t.first), at - t.first};
      if (from == 1) t.weights = {1};
    }
  }
  return taps;
}

void check_size(int width, int height) {
  if (width < 1 || height < 1)
    throw Error(ErrorKind::Failed, "a size must be positive", "resize", fmt::format("{}x{}", width, height));
}

Image resize(const Image& image, int width, int height, Shrink how) {
  check_size(width, height);
  if (image.width == width && image.height == height) return image;
  const auto columns = taps_of(image.width, width, how), rows = taps_of(image.height, height, how);
  Image out(width, height, image.channels);
  std::vector<double> line(static_cast<std::size_t>(image.width));
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < height; ++y) {
      const Taps& row = rows[static_cast<std::size_t>(y)];
      std::fill(line.begin(), line.end(), 0.0);
      for (std::size_t k = 0; k < row.weights.size(); ++k)
        for (int x = 0; x < image.width; ++x)
          line[static_cast<std::size_t>(x)] += row.weights[k] * image.at(c, row.first + static_cast<int>(k), x);
      for (int x = 0; x < width; ++x) {
        const Taps& column = columns[static_cast<std::size_t>(x)];
        double value = 0;
        for (std::size_t k = 0; k < column.weights.size(); ++k)
          value += column.weights[k] * line[static_cast<std::size_t>(column.first) + k];
        out.at(c, y, x) = static_cast<float>(value);
      }
    }
  return out;
}

}  // namespace

Image resize_area(const Image& image, int width, int height) { return resize(image, width, height, Shrink::Average); }

Image resize_bilinear(const Image& image, int width, int height) {
  return resize(image, width, height, Shrink::Interpolate);
}

Image resize_nearest(const Image& image, int width, int height) {
  check_size(width, height);
  if (image.width == width && image.height == height) return image;
  Image out(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        out.at(c, y, x) = image.at(c, static_cast<int>((y + 0.5) * image.height / height),
                                   static_cast<int>((x + 0.5) * image.width / width));
  return out;
}

Size net_size(int width, int height, int longer) {
  const double scale = static_cast<double>(longer) / std::max(width, height);
  return {std::max(1, static_cast<int>(std::lround(width * scale))),
          std::max(1, static_cast<int>(std::lround(height * scale)))};
}

}  // namespace clerestory
