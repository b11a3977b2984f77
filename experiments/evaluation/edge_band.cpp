#include "experiments/evaluation/edge_band.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace clerestory {
namespace {

/// Whether the map steps between two pixels.
using Steps = std::function<bool(std::size_t, std::size_t)>;

Steps steps_by(const Image& map, double most) {
  return [&map, most](std::size_t a, std::size_t b) {
    for (int c = 0; c < map.channels; ++c)
      if (std::abs(map.plane(c)[a] - map.plane(c)[b]) > most) return true;
    return false;
  };
}

Steps turns_by(const Image& normal, double degrees) {
  return [&normal, least = std::cos(degrees * std::numbers::pi / 180)](std::size_t a, std::size_t b) {
    double cosine = 0;
    for (int c = 0; c < 3; ++c)
      cosine += static_cast<double>(normal.plane(c)[a]) * static_cast<double>(normal.plane(c)[b]);
    return cosine < least;
  };
}

Steps grows_by(const Image& depth, double factor) {
  return [&depth, factor](std::size_t a, std::size_t b) {
    const auto [nearer, farther] = std::minmax(depth.data[a], depth.data[b]);
    return farther > factor * nearer;
  };
}

/// Pixels beside an edge, then those within reach: the largest of a window, by rows and then by columns.
Image band(const Image& mask, const std::vector<Steps>& steps, int reach) {
  const int w = mask.width, h = mask.height;
  Image edges(w, h, 1);
  const auto mark = [&](std::size_t a, std::size_t b) {
    if (mask.data[a] > 0.5f && mask.data[b] > 0.5f &&
        std::ranges::any_of(steps, [&](const Steps& s) { return s(a, b); }))
      edges.data[a] = edges.data[b] = 1;
  };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const auto at = static_cast<std::size_t>(y) * w + x;
      if (x + 1 < w) mark(at, at + 1);
      if (y + 1 < h) mark(at, at + w);
    }
  Image wide(w, h, 1), out(w, h, 1);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int near = std::max(x - reach, 0); near <= std::min(x + reach, w - 1); ++near)
        wide.at(0, y, x) = std::max(wide.at(0, y, x), edges.at(0, y, near));
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (int near = std::max(y - reach, 0); near <= std::min(y + reach, h - 1); ++near)
        out.at(0, y, x) = std::max(out.at(0, y, x), wide.at(0, near, x));
  for (std::size_t i = 0; i < out.data.size(); ++i) out.data[i] = out.data[i] > 0.5f && mask.data[i] > 0.5f;
  return out;
}

Image without(const Image& mask, const Image& other) {
  Image out(mask.width, mask.height, 1);
  for (std::size_t i = 0; i < out.data.size(); ++i) out.data[i] = mask.data[i] > 0.5f && !(other.data[i] > 0.5f);
  return out;
}

}  // namespace

MapMasks edge_bands(const MapSet& truth, const MapMasks& masks, int reach) {
  return {band(masks.geometry, {turns_by(truth.normal, edge_degrees), grows_by(truth.depth, edge_depth)}, reach),
          band(masks.albedo, {steps_by(truth.albedo, edge_albedo)}, reach),
          band(masks.material, {steps_by(truth.material, edge_material)}, reach)};
}

MapMasks without(const MapMasks& masks, const MapMasks& other) {
  return {without(masks.geometry, other.geometry), without(masks.albedo, other.albedo),
          without(masks.material, other.material)};
}

}  // namespace clerestory
