// How fast screen-space rays are on a device.
#include <algorithm>
#include <cmath>
#include <random>

#include "host/cl/seconds_of.hpp"
#include "host/graph/plan.hpp"
#include "host/math/frames.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/ops/light/depth_pyramid.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory {
namespace {

constexpr int kChunkPixels = 4096, kChunks = 8;

}  // namespace

SsrtSpeed ssrt_speed(Device device, int width, int height, SsrtSolver solver, int samples, int repeats) {
  const auto [camera, depth, normal] = bench_room(width, height);

  // Eight runs of pixels, from the top of the picture to its bottom, each with cosine-distributed rays of its own.
  const int pixels = std::min(kChunkPixels, width * height), chunks = std::min(kChunks, width * height / pixels);
  const Shape rays{1, 3, pixels, samples};
  Graph graph;
  const Value in_depth = graph.input("depth", depth.shape), in_camera = graph.input("camera", {1, 4, 1, 1});
  const Value in_range = graph.input("range", {1, 3, 1, 1}), directions = graph.input("directions", rays);
  const Value in_pyramid =
      graph.input("pyramid", {1, 1, pyramid_layout(width, height).level_rows, pyramid_layout(width, height).stride});
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
      const int y = static_cast<int>((first + p) / width), x = static_cast<int>((first + p) % width);
      const Frame frame = frame_around({normal.at(0, 0, y, x), normal.at(0, 1, y, x), normal.at(0, 2, y, x)});
      for (int s = 0; s < samples; ++s) {
        const double u = unit(random), turn = 2 * M_PI * unit(random);
        const Vec3 v =
            frame.from_local({std::sqrt(u) * std::cos(turn), std::sqrt(u) * std::sin(turn), std::sqrt(1 - u)});
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
    const double seconds = seconds_of(device, [&] {
      for (std::size_t k = 0; k < runs.size(); ++k) runs[k]->run(0, where[k]);
    });
    if (r > 0) best = std::min(best, seconds);
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
