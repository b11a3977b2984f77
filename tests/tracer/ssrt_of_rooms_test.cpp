// Screen-space rays in a room beside the tracer's: what the maps show is met where it is, and what they do not show is
// missed or called unsure.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>
#include <random>

#include "checks/op_case.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/light/ssrt.hpp"
#include "tests/tracer/scenes.hpp"

namespace clerestory {
namespace {

constexpr int kSamples = 16;   // of each pixel
constexpr double kOff = 1e-4;  // metres before a surface: depth in float is wrong by less

Tensor tensor_of(const Image& image) { return Tensor({1, image.channels, image.height, image.width}, image.data); }

/// Rays from what each pixel sees, over its surface in all directions alike. Ray i is sample i % kSamples of its pixel.
struct RoomRays {
  std::vector<Vec3> points, along;  // world
  Tensor directions;
};

RoomRays rays_of(const Camera& camera, const TraceMaps& maps) {
  const auto pixels = static_cast<int>(maps.depth.pixels());
  RoomRays rays{{}, {}, Tensor({1, 3, pixels, kSamples})};
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < pixels * kSamples; ++i) {
    const int pixel = i / kSamples, x = pixel % camera.width, y = pixel / camera.width;
    Vec3 n, d(normal(random), normal(random), normal(random));
    for (int c = 0; c < 3; ++c) n[c] = maps.normal.at(c, y, x);
    d = glm::normalize(glm::dot(d, n) < 0 ? -d : d);
    for (int c = 0; c < 3; ++c) rays.directions.at(0, c, pixel, i % kSamples) = d[c];
    const Vec3 surface = camera.unproject(x + 0.5, y + 0.5, maps.depth.at(0, y, x));
    rays.points.push_back(camera.to_world(surface + kOff * n));
    rays.along.push_back(camera.direction_to_world(d));
  }
  return rays;
}

/// The pixel and delta of each ray, by cells that face it.
std::vector<Tensor> screen_hits(const Camera& camera, const TraceMaps& maps, const RoomRays& rays) {
  const Tensors feeds{{"depth", tensor_of(maps.depth)},
                      {"normal", tensor_of(maps.normal)},
                      {"camera", camera_tensor(std::vector<Camera>{camera})},
                      {"range", depth_range(tensor_of(maps.depth))},
                      {"directions", rays.directions}};
  Graph g;
  Values in;
  for (const auto& [name, tensor] : feeds) in[name] = g.input(name, tensor.shape);
  const SsrtHits hits = ssrt(ssrt_scene(in["depth"], in["normal"]), in["camera"], in["range"], in["directions"]);
  return evaluate(g, {hits.pixel, hits.delta}, test_device(), feeds);
}

/// Where on the picture a point in camera space is seen, if what is seen there is that point.
std::optional<Vec2> seen_at(const Camera& camera, const Image& depth, const Vec3& point) {
  const auto at = camera.project(point);
  if (!at || at->x < 0 || at->y < 0 || at->x >= camera.width || at->y >= camera.height) return {};
  const double in_front = depth.at(0, static_cast<int>(at->y), static_cast<int>(at->x));
  return -point.z < 1.02 * in_front ? at : std::nullopt;  // a cell's depth is that of its middle
}

/// What became of rays, by what they meet: shares of those whose surface the picture shows, and of the others.
struct Outcome {
  double met = 0, unsure = 0;  // shown: the cell itself, or its neighbour's neighbour; another one with u above 0.1
  double mistaken = 0;         // not shown, but something is met for sure
  double lost() const { return 1 - met - unsure; }
};

Outcome outcome_of(int width, int height) {
  TraceScene room(test_device(), plain_room());
  Camera camera = Camera::from_fov(width, height, 75.0);
  camera.set_pose(Mat3(glm::rotate(glm::dmat4(1), 0.5, glm::dvec3(0, 1, 0))), {1.2, 1.4, 1.6});
  const TraceMaps maps = room.maps(camera);
  const RoomRays rays = rays_of(camera, maps);
  const std::vector<TraceHit> truth = room.hits(planar(rays.points), planar(rays.along), 0, 1e9f);
  const std::vector<Tensor> got = screen_hits(camera, maps, rays);
  double shown = 0, hidden = 0;
  Outcome sum;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_GE(truth[i].triangle, 0) << "the room is closed";
    const Vec3 point = camera.to_camera(rays.points[i] + double{truth[i].t} * rays.along[i]);
    const int pixel = got[0].integer[i];
    const bool sure = pixel >= 0 && got[1].real[i] < std::atanh(0.1) / 10;
    if (const auto place = seen_at(camera, maps.depth, point)) {
      const Vec2 off{pixel % width + 0.5 - place->x, pixel / width + 0.5 - place->y};
      const bool near = pixel >= 0 && std::abs(off.x) <= 2 && std::abs(off.y) <= 2;
      shown += 1, sum.met += near, sum.unsure += pixel >= 0 && !near && !sure;
    } else {
      hidden += 1, sum.mistaken += sure;
    }
  }
  EXPECT_GT(std::min(shown, hidden), 0.2 * static_cast<double>(truth.size()));
  return {sum.met / shown, sum.unsure / shown, sum.mistaken / hidden};
}

// A corner of a room with a block before it: rays that pass behind the block are stopped by it, and called unsure.
// What else goes wrong is the doing of cells, whose depth is that of their middle: half as large, they are mistaken for
// what they hide half as often.
TEST(SsrtOfRooms, WhatIsSeenIsMetWhereItIs) {
  const Outcome coarse = outcome_of(80, 60), fine = outcome_of(160, 120);
  EXPECT_LT(coarse.lost(), 0.02);
  EXPECT_LT(fine.lost(), coarse.lost());
  EXPECT_LT(fine.unsure, 0.04);
  EXPECT_LT(coarse.mistaken, 0.01);
  EXPECT_LT(fine.mistaken, 0.6 * coarse.mistaken);
}

}  // namespace
}  // namespace clerestory
