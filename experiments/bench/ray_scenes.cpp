#include "experiments/bench/ray_scenes.hpp"

#include <cmath>

#include "experiments/bench/bench.hpp"
#include "host/error.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/data_files.hpp"
#include "host/io/image.hpp"
#include "host/io/resize.hpp"
#include "host/ops/light/bench_room.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

constexpr int kReach = 3;  // pixels: differences over fewer are the sensor's noise

/// The normals of the points that a depth map shows, from the differences between those kReach pixels to each side;
/// where one is missing, from the pixel itself on. Towards the viewer where both differences are missing.
Image normals_of(const Image& depth, const Camera& camera) {
  Image normal(depth.width, depth.height, 3);
  const auto point = [&](int x, int y) {
    return camera.unproject(x + 0.5, y + 0.5, static_cast<double>(depth.at(0, y, x)));
  };
  const auto shown = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < depth.width && y < depth.height && depth.at(0, y, x) > 0;
  };
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const auto difference = [&](int dx, int dy) {
        const int before = shown(x - dx, y - dy), after = shown(x + dx, y + dy);
        return point(x + after * dx, y + after * dy) - point(x - before * dx, y - before * dy);
      };
      const Vec3 towards = -camera.direction(x + 0.5, y + 0.5);
      Vec3 n = shown(x, y) ? glm::cross(difference(kReach, 0), difference(0, kReach)) : towards;
      if (!(glm::length(n) > 0)) n = towards;
      n = glm::normalize(glm::dot(n, towards) < 0 ? -n : n);
      for (int c = 0; c < 3; ++c) normal.at(c, y, x) = static_cast<float>(n[c]);
    }
  return normal;
}

RayScene room(int width, int height) {
  BenchRoom room = bench_room(width, height);
  return {"room", room.camera, std::move(room.depth), std::move(room.normal)};
}

RayScene office(int width, int height) {
  const auto folder = found_data("assets/real/office");
  const Image depth = read_map(folder / "depth.exr", 1);
  const Camera camera = read_camera(folder / "camera.json").camera;
  const auto resized = [&](const Image& map) { return tensor_of(resize_nearest(map, width, height)); };
  return {"office", camera.resized(width, height), resized(depth), resized(normals_of(depth, camera))};
}

RayScene unordered(int width, int height) {
  RayScene scene{"noise", Camera::from_fov(width, height, 65.0), noise({1, 1, height, width}, 1, 0.5),
                 noise({1, 3, height, width}, 2, 0.5)};
  for (double& depth : scene.depth.real) depth += 2.5;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Vec3 n = -scene.camera.direction(x + 0.5, y + 0.5);
      for (int c = 0; c < 3; ++c) n[c] += scene.normal.at(0, c, y, x);
      n = glm::normalize(n);
      for (int c = 0; c < 3; ++c) scene.normal.at(0, c, y, x) = n[c];
    }
  return scene;
}

}  // namespace

RayScene ray_scene(const std::string& name, int width, int height) {
  if (name == "room") return room(width, height);
  if (name == "office") return office(width, height);
  if (name == "noise") return unordered(width, height);
  throw usage_error("no such scene for rays", "bench", name, "room | office | noise");
}

}  // namespace clerestory
