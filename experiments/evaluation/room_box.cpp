#include "experiments/evaluation/room_box.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "experiments/evaluation/manhattan.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

/// Distances beside the floor's, as rooms have them, and the deviation of their logarithms.
constexpr double kSpread = 0.4, kCeilingSpread = 0.25;
constexpr double kConflict = 0.1;  // what a pixel of a line costs on a face that it would have to pierce

int face_of(int axis, bool minus) { return 2 * axis + minus; }

/// Where a ray of the room's frame leaves the box, and through which face.
struct Exit {
  double distance = std::numeric_limits<double>::infinity();
  int face = 0;
};
Exit leaves(const RoomBox& box, const Vec3& ray) {
  Exit exit;
  for (int k = 0; k < 3; ++k) {
    const bool minus = ray[k] < 0;
    const double wall = (minus ? box.minus : box.plus)[static_cast<std::size_t>(k)];
    const double distance = ray[k] == 0 ? std::numeric_limits<double>::infinity() : wall / std::abs(ray[k]);
    if (distance < exit.distance) exit = {distance, face_of(k, minus)};
  }
  return exit;
}

/// How lines of the picture speak for edges of a box, by the axis along which these run.
class Evidence {
 public:
  Evidence(const std::vector<LineSegment>& lines, const Mat3& axes, const Camera& camera)
      : width_(camera.width), height_(camera.height) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) rays_.push_back(glm::transpose(axes) * camera.ray(x + 0.5, y + 0.5));
    for (std::size_t k = 0; k < 3; ++k) {
      maps_[k].assign(rays_.size(), 0);
      for (const LineSegment& line : lines)
        draw(line, line_fit(plane_of(line, camera), axes[static_cast<int>(k)]), maps_[k]);
      mean_[k] = mean(maps_[k]), deviation_[k] = std::max(standard_deviation(maps_[k]), 1e-9);
    }
  }

  /// By how many deviations lines under the box's edges are more than those of as many pixels by chance; less where the
  /// box is none that rooms have.
  double score(const RoomBox& box) const {
    std::vector<int> face;
    for (const Vec3& ray : rays_) face.push_back(leaves(box, ray).face);
    double total = 0;
    int count = 0;
    const auto add = [&](std::size_t a, std::size_t b) {
      const int k = face[a] / 2, l = face[b] / 2;
      if (k == l) return;  // of one face, or of two that do not meet
      const auto along = static_cast<std::size_t>(3 - k - l);
      total += (std::max(maps_[along][a], maps_[along][b]) - mean_[along]) / deviation_[along], ++count;
    };
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        if (x + 1 < width_) add(at(x, y), at(x + 1, y));
        if (y + 1 < height_) add(at(x, y), at(x, y + 1));
      }
    double pierced = 0;  // no line of a surface runs along its normal
    for (std::size_t i = 0; i < face.size(); ++i) pierced += maps_[static_cast<std::size_t>(face[i] / 2)][i];
    return (count > 0 ? total / std::sqrt(count) : 0) - kConflict * pierced - unlikely(box);
  }

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width_ + x); }

  /// Onto the pixels within one of the line.
  void draw(const LineSegment& line, double fit, std::vector<double>& map) const {
    const int steps = static_cast<int>(std::ceil(2 * line.length()));
    for (int i = 0; i <= steps; ++i) {
      const Vec2 p = glm::mix(line.from, line.to, static_cast<double>(i) / steps);
      const int column = static_cast<int>(p.x), row = static_cast<int>(p.y);
      for (int y = std::max(row - 1, 0); y <= std::min(row + 1, height_ - 1); ++y)
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, width_ - 1); ++x)
          map[at(x, y)] = std::max(map[at(x, y)], fit);
    }
  }

  static double unlikely(const RoomBox& box) {
    const RoomBox typical;
    double total = 0;
    for (std::size_t k = 0; k < 3; ++k)
      for (const auto side : {&RoomBox::plus, &RoomBox::minus}) {
        const bool ceiling = k == 1 && side == &RoomBox::plus;
        const double off = std::log((box.*side)[k] / (typical.*side)[k]) / (ceiling ? kCeilingSpread : kSpread);
        total += 0.5 * off * off;
      }
    return total;
  }

  int width_, height_;
  std::vector<Vec3> rays_;  // of the room's frame
  std::array<std::vector<double>, 3> maps_;
  std::array<double, 3> mean_{}, deviation_{};
};

/// All walls but the floor, which is the unit: the best of `factors` times each, one wall after another, twice.
void improve(RoomBox& box, const Evidence& evidence, const std::vector<double>& factors) {
  double best = evidence.score(box);
  for (int round = 0; round < 2; ++round)
    for (std::size_t k = 0; k < 3; ++k)
      for (const auto side : {&RoomBox::plus, &RoomBox::minus}) {
        if (k == 1 && side == &RoomBox::minus) continue;
        const double from = (box.*side)[k];
        double chosen = from;
        for (const double factor : factors) {
          (box.*side)[k] = from * factor;
          if (const double now = evidence.score(box); now > best) best = now, chosen = from * factor;
        }
        (box.*side)[k] = chosen;
      }
}

/// So many factors to each side of 1, up to `most`.
std::vector<double> factors(double most, int count) {
  std::vector<double> all;
  for (int i = -count; i <= count; ++i)
    if (i != 0) all.push_back(std::pow(most, static_cast<double>(i) / count));
  return all;
}

}  // namespace

BoxMaps maps_of(const RoomBox& box, const Camera& camera) {
  BoxMaps maps{Image(camera.width, camera.height, 3), Image(camera.width, camera.height, 1), {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Exit exit = leaves(box, glm::transpose(box.axes) * camera.ray(x + 0.5, y + 0.5));
      const Vec3 normal = (exit.face % 2 == 0 ? -1.0 : 1.0) * box.axes[exit.face / 2];
      for (int c = 0; c < 3; ++c) maps.normal.at(c, y, x) = static_cast<float>(normal[c]);
      maps.depth.at(0, y, x) = static_cast<float>(exit.distance);  // a ray's z is -1
      maps.face.push_back(exit.face);
    }
  return maps;
}

RoomBox fitted_box(const Image& picture, const Camera& camera) {
  const std::vector<LineSegment> lines = line_segments(picture);
  RoomBox best;
  best.axes = manhattan_frame(lines, camera);
  const Evidence evidence(lines, best.axes, camera);
  const RoomBox typical = best;
  double score = -std::numeric_limits<double>::infinity();
  for (const double front : {0.6, 1.0, 1.6}) {  // of the typical distance: one wall at a time does not find all
    RoomBox box = typical;
    box.minus[2] *= front;
    improve(box, evidence, factors(3, 12)), improve(box, evidence, factors(1.1, 4));
    if (const double now = evidence.score(box); now > score) score = now, best = box;
  }
  return best;
}

}  // namespace clerestory
