#include "experiments/evaluation/manhattan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "experiments/evaluation/radiance_error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAligned = 22.5 * kDegree;           // of a region's edges about their mean direction
constexpr double kFaint = 0.03;                       // of what a screen shows, a pixel: no edge below
constexpr double kShortest = 8, kThinnest = 4;        // pixels; length over width
constexpr double kSpread = 2 * kDegree;               // of a line about the direction that it follows
constexpr double kStray = 0.05;                       // a line that follows none fits so well
constexpr double kYaw = 180, kPitch = 20, kRoll = 3;  // degrees that cameras are held at, deviations; any yaw will do
constexpr double kLength = 20;                        // pixels of a line that say as much as one observation

/// By rows and then columns with 1 2 1, borders repeated.
std::vector<double> blurred(const std::vector<double>& values, int w, int h) {
  std::vector<double> rows(values.size()), out(values.size());
  const auto at = [w](int x, int y) { return static_cast<std::size_t>(y * w + x); };
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      rows[at(x, y)] =
          (values[at(std::max(x - 1, 0), y)] + 2 * values[at(x, y)] + values[at(std::min(x + 1, w - 1), y)]) / 4;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      out[at(x, y)] = (rows[at(x, std::max(y - 1, 0))] + 2 * rows[at(x, y)] + rows[at(x, std::min(y + 1, h - 1))]) / 4;
  return out;
}

/// Collects regions of edges, the strongest first.
class Segments {
 public:
  explicit Segments(const Image& picture)
      : w_(picture.width), h_(picture.height), edge_(picture.pixels()), used_(picture.pixels()) {
    std::vector<double> shown;
    for (std::size_t i = 0; i < picture.pixels(); ++i)
      shown.push_back(shown_value(luminance(picture.plane(0)[i], picture.plane(1)[i], picture.plane(2)[i])));
    shown = blurred(shown, w_, h_);
    for (int y = 1; y + 1 < h_; ++y)
      for (int x = 1; x + 1 < w_; ++x)
        edge_[at(x, y)] =
            Vec2(shown[at(x + 1, y)] - shown[at(x - 1, y)], shown[at(x, y + 1)] - shown[at(x, y - 1)]) / 2.0;
  }

  std::vector<LineSegment> all() {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < edge_.size(); ++i)
      if (glm::length(edge_[i]) >= kFaint) order.push_back(i);
    std::ranges::stable_sort(order, std::ranges::greater(), [&](std::size_t i) { return glm::length(edge_[i]); });
    std::vector<LineSegment> segments;
    for (const std::size_t i : order)
      if (!used_[i]) add_segment(region_from(i), segments);
    return segments;
  }

 private:
  std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * w_ + x); }
  Vec2 position(std::size_t i) const {
    const auto w = static_cast<std::size_t>(w_);
    return {static_cast<double>(i % w) + 0.5, static_cast<double>(i / w) + 0.5};
  }

  std::vector<std::size_t> region_from(std::size_t first) {
    std::vector<std::size_t> region{first};
    used_[first] = true;
    Vec2 direction = glm::normalize(edge_[first]);  // of all so far, summed up
    for (std::size_t k = 0; k < region.size(); ++k) {
      const int x = static_cast<int>(region[k] % static_cast<std::size_t>(w_)),
                y = static_cast<int>(region[k] / static_cast<std::size_t>(w_));
      for (int v = y - 1; v <= y + 1; ++v)
        for (int u = x - 1; u <= x + 1; ++u) {
          if (u < 0 || v < 0 || u >= w_ || v >= h_ || used_[at(u, v)]) continue;
          const double strength = glm::length(edge_[at(u, v)]);
          if (strength < kFaint) continue;
          const Vec2 own = edge_[at(u, v)] / strength;
          if (glm::dot(own, glm::normalize(direction)) < std::cos(kAligned)) continue;
          used_[at(u, v)] = true, region.push_back(at(u, v)), direction += own;
        }
    }
    return region;
  }

  /// Along the region's longer axis, if it is long and thin.
  void add_segment(const std::vector<std::size_t>& region, std::vector<LineSegment>& segments) const {
    Vec2 centre(0, 0);
    double weight = 0;
    for (const std::size_t i : region) centre += glm::length(edge_[i]) * position(i), weight += glm::length(edge_[i]);
    centre /= weight;
    double xx = 0, xy = 0, yy = 0;
    for (const std::size_t i : region) {
      const Vec2 d = position(i) - centre;
      const double m = glm::length(edge_[i]);
      xx += m * d.x * d.x, xy += m * d.x * d.y, yy += m * d.y * d.y;
    }
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
    const Vec2 along(std::cos(angle), std::sin(angle)), across(-along.y, along.x);
    double low = 0, high = 0, left = 0, right = 0;
    for (const std::size_t i : region) {
      const Vec2 d = position(i) - centre;
      low = std::min(low, glm::dot(d, along)), high = std::max(high, glm::dot(d, along));
      left = std::min(left, glm::dot(d, across)), right = std::max(right, glm::dot(d, across));
    }
    if (high - low < kShortest || high - low < kThinnest * (right - left)) return;
    segments.push_back({centre + low * along, centre + high * along});
  }

  int w_, h_;
  std::vector<Vec2> edge_;  // gradients
  std::vector<bool> used_;
};

/// A segment as the frame is judged by it.
struct Line {
  Vec3 plane;
  double weight;
};

/// Yaw, pitch and roll, degrees, to the room's axes in camera space.
struct Pose {
  std::array<double, 3> angles{};
  Mat3 axes() const {
    const auto [yaw, pitch, roll] = angles;
    const auto turn = [](int axis, double degrees) {
      const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      Mat3 m(1);
      m[a][a] = c, m[b][b] = c, m[a][b] = s, m[b][a] = -s;
      return m;
    };
    return turn(2, roll) * turn(0, pitch) * turn(1, yaw);
  }
};

double score(const std::vector<Line>& lines, const Pose& pose) {
  const Mat3 axes = pose.axes();
  double total = 0;
  for (const Line& line : lines) {
    double fit = 0;
    for (int k = 0; k < 3; ++k) fit = std::max(fit, line_fit(line.plane, axes[k]));
    total += line.weight * std::log(kStray + fit);
  }
  const double yaw = pose.angles[0] / kYaw, pitch = pose.angles[1] / kPitch, roll = pose.angles[2] / kRoll;
  return total - 0.5 * (yaw * yaw + pitch * pitch + roll * roll);
}

/// Up by steps of each angle, ever smaller.
Pose climbed(const std::vector<Line>& lines, Pose pose) {
  double best = score(lines, pose);
  for (double step = 2; step > 0.1; step /= 2)
    for (bool better = true; better;) {
      better = false;
      for (double& angle : pose.angles)
        for (const double by : {step, -step}) {
          angle += by;
          if (const double now = score(lines, pose); now > best)
            best = now, better = true;
          else
            angle -= by;
        }
    }
  return pose;
}

}  // namespace

std::vector<LineSegment> line_segments(const Image& picture) { return Segments(picture).all(); }

Vec3 plane_of(const LineSegment& segment, const Camera& camera) {
  return glm::normalize(glm::cross(camera.ray(segment.from.x, segment.from.y), camera.ray(segment.to.x, segment.to.y)));
}

double line_fit(const Vec3& plane, const Vec3& direction) {
  const double off = glm::dot(plane, direction) / kSpread;
  return std::exp(-0.5 * off * off);
}

Mat3 manhattan_frame(const std::vector<LineSegment>& segments, const Camera& camera) {
  std::vector<Line> lines;
  for (const LineSegment& s : segments) lines.push_back({plane_of(s, camera), s.length() / kLength});
  std::vector<std::pair<double, Pose>> poses;
  for (double yaw = -45; yaw < 45; yaw += 3)
    for (double pitch = -60; pitch <= 60; pitch += 3)
      for (double roll = -6; roll <= 6; roll += 2) {
        const Pose pose{{yaw, pitch, roll}};
        poses.emplace_back(score(lines, pose), pose);
      }
  constexpr std::size_t kClimb = 16;  // of the best of the grid
  std::ranges::partial_sort(poses, poses.begin() + kClimb, std::ranges::greater(), &std::pair<double, Pose>::first);
  Pose best = climbed(lines, poses[0].second);
  for (std::size_t i = 1; i < kClimb; ++i)
    if (const Pose pose = climbed(lines, poses[i].second); score(lines, pose) > score(lines, best)) best = pose;
  return best.axes();
}

}  // namespace clerestory
