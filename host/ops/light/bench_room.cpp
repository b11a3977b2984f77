#include "host/ops/light/bench_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace clerestory {
namespace {

struct Box {
  Vec3 low, high;
};
struct Ball {
  Vec3 centre;
  double radius;
};
const Box kRoom{{-2.2, -1.3, -5.0}, {2.2, 1.4, 1.0}};
const std::array kBoxes{Box{{-1.5, -1.3, -4.2}, {-0.3, -0.4, -3.1}}, Box{{0.4, -1.3, -3.0}, {1.1, -0.6, -2.2}},
                        Box{{1.2, -1.3, -4.9}, {2.0, 0.6, -4.2}}, Box{{-2.2, -0.2, -2.6}, {-1.8, 0.9, -1.9}}};
const std::array kBalls{Ball{{-0.9, -0.1, -3.6}, 0.3}, Ball{{0.75, -0.4, -2.6}, 0.2}, Ball{{0.3, -1.0, -4.0}, 0.3}};

struct Seen {
  double depth = INFINITY;
  Vec3 normal{0, 0, 1};
};

/// The room along a ray from the origin with z = -1, so that the parameter is the depth.
Seen look(const Vec3& d) {
  Seen seen;
  const auto face = [&](double t, int axis) {
    if (t >= seen.depth) return;
    seen.depth = t, seen.normal = Vec3(0);
    seen.normal[axis] = d[axis] > 0 ? -1 : 1;
  };
  for (int a = 0; a < 3; ++a)
    if (d[a] != 0) face((d[a] > 0 ? kRoom.high[a] : kRoom.low[a]) / d[a], a);
  for (const Box& box : kBoxes) {
    double enter = 0, leave = INFINITY;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      const double t0 = box.low[a] / d[a], t1 = box.high[a] / d[a];
      if (std::min(t0, t1) > enter) enter = std::min(t0, t1), axis = a;
      leave = std::min(leave, std::max(t0, t1));
    }
    if (axis >= 0 && enter < leave) face(enter, axis);
  }
  for (const Ball& ball : kBalls) {
    const double a = glm::dot(d, d), b = glm::dot(d, ball.centre);
    const double root = b * b - a * (glm::dot(ball.centre, ball.centre) - ball.radius * ball.radius);
    if (root <= 0) continue;
    const double t = (b - std::sqrt(root)) / a;
    if (t > 0 && t < seen.depth) seen = {t, (t * d - ball.centre) / ball.radius};
  }
  return seen;
}

}  // namespace

BenchRoom bench_room(int width, int height) {
  BenchRoom room{Camera::from_fov(width, height, 65.0), Tensor(Shape{1, 1, height, width}),
                 Tensor(Shape{1, 3, height, width})};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Seen seen = look(room.camera.ray(x + 0.5, y + 0.5));
      room.depth.at(0, 0, y, x) = seen.depth;
      for (int c = 0; c < 3; ++c) room.normal.at(0, c, y, x) = seen.normal[c];
    }
  return room;
}

}  // namespace clerestory
