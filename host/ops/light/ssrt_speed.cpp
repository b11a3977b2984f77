// How fast screen-space rays are on a device, over a picture whose content does not change: a furnished box room.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>

#include "host/graph/plan.hpp"
#include "host/math/frames.hpp"
#include "host/ops/light/depth_pyramid.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory {
namespace {

constexpr int kChunkPixels = 4096, kChunks = 8;

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

SsrtSpeed ssrt_speed(Device device, int width, int height, SsrtSolver solver, int samples, int repeats) {
  const Camera camera = Camera::from_fov(width, height, 65.0);
  Tensor depth(Shape{1, 1, height, width});
  std::vector<Vec3> normals;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Seen seen = look(camera.ray(x + 0.5, y + 0.5));
      depth.at(0, 0, y, x) = seen.depth;
      normals.push_back(seen.normal);
    }

  // Eight runs of pixels, from the top of the picture to its bottom, each with cosine-distributed rays of its own.
  const int pixels = std::min(kChunkPixels, width * height), chunks = std::min(kChunks, width * height / pixels);
  const Shape rays{1, 3, pixels, samples};
  Graph graph;
  const Value in_depth = graph.input("depth", depth.shape), in_camera = graph.input("camera", {1, 4, 1, 1});
  const Value in_range = graph.input("range", {1, 3, 1, 1}), directions = graph.input("directions", rays);
  const Value in_pyramid = graph.input("pyramid", {1, 1, pyramid_layout(width, height).level_rows, pyramid_layout(width, height).stride});
  const SsrtHits hits = ssrt(in_depth, in_pyramid, in_camera, in_range, directions, {}, {}, {.solver = solver});
  Graph before;
  const Value before_depth = before.input("depth", depth.shape);
  const Value pyramid = depth_pyramid(before_depth);
  Executor prepare(compile(before, {pyramid}, device));
  prepare.feed("depth", depth);
  prepare.run();

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<std::unique_ptr<Executor>> runs;
  std::vector<Chunk> where;
  for (int k = 0; k < chunks; ++k) {
    const long first = chunks > 1 ? static_cast<long>(k) * (width * height - pixels) / (chunks - 1) : 0;
    Tensor d(rays);
    for (int p = 0; p < pixels; ++p) {
      const Frame frame = frame_around(normals[static_cast<std::size_t>(first + p)]);
      for (int s = 0; s < samples; ++s) {
        const double u = unit(random), turn = 2 * M_PI * unit(random);
        const Vec3 v = frame.from_local({std::sqrt(u) * std::cos(turn), std::sqrt(u) * std::sin(turn), std::sqrt(1 - u)});
        for (int c = 0; c < 3; ++c) d.at(0, c, p, s) = v[c];
      }
    }
    runs.push_back(std::make_unique<Executor>(compile(graph, {hits.pixel, hits.delta, hits.u}, device)));
    runs.back()->feed("depth", depth);
    runs.back()->feed("camera", camera_tensor(std::span(&camera, 1)));
    runs.back()->feed("range", depth_range(depth));
    runs.back()->feed("directions", d);
    runs.back()->bind("pyramid", prepare.view(pyramid));
    where.push_back({static_cast<int>(first), pixels, 0, samples});
  }

  SsrtSpeed speed;
  double best = INFINITY;
  for (int r = 0; r <= repeats; ++r) {  // the first builds the kernels
    device.finish();
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t k = 0; k < runs.size(); ++k) runs[k]->run(0, where[k]);
    device.finish();
    if (r > 0) best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  double hit = 0;
  for (const auto& run : runs)
    for (const int pixel : run->fetch(hits.pixel).integer) hit += pixel >= 0;
  const double count = static_cast<double>(chunks) * pixels * samples;
  speed.million_rays_per_second = count / best * 1e-6;
  speed.hit_share = hit / count;
  return speed;
}

}  // namespace clerestory
