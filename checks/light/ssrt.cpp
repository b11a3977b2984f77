// Screen-space rays against brute force over all cells.
#include "host/ops/light/ssrt.hpp"

#include <cmath>

#include "checks/light/brute_force.hpp"
#include "checks/light/ssrt_scenes.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace ssrt_scenes;

/// The camera of the inputs, which are rounded to float.
Camera camera_in(const Tensors& t) {
  Camera c;
  const Tensor& v = t.at("camera");
  c.fx = v.at(0, 0, 0, 0), c.fy = v.at(0, 1, 0, 0), c.cx = v.at(0, 2, 0, 0), c.cy = v.at(0, 3, 0, 0);
  return c;
}

OP_CASES(light_ssrt) {
  // Rays whose cells are the same in float (EqualsBruteForce... tells how seldom that is not so).
  const Scene scene = scene_of(1, 6, 7, 30);
  Tensors inputs{{"depth", scene.depth},
                 {"camera", scene.cameras()},
                 {"range", depth_range(scene.depth)},
                 {"directions", directions(42, 31)}};
  const auto build = [](Graph&, const Values& v) {
    const SsrtHits hits = ssrt(ssrt_scene(v.at("depth")), v.at("camera"), v.at("range"), v.at("directions"));
    return std::vector<Value>{hits.pixel, hits.delta, hits.u};
  };
  const auto reference = [](const Tensors& t) {
    const Tensor& depth = t.at("depth");
    const Camera camera = camera_in(t);
    const BruteForce brute{camera, &depth, nullptr, 0, 0};
    std::vector<int> pixel;
    Tensor delta(Shape{1, 1, 42, 16}), u(Shape{1, 1, 42, 16});
    for (int p = 0; p < 42; ++p)
      for (int k = 0; k < 16; ++k) {
        const double z = depth.at(0, 0, p / 7, p % 7);
        const Tensor& d = t.at("directions");
        const Vec3 direction{d.at(0, 0, p, k), d.at(0, 1, p, k), d.at(0, 2, p, k)};
        const BruteForce::Hit hit =
            z > 0 ? brute.trace(camera.unproject(p % 7 + 0.5, p / 7 + 0.5, z), direction, p) : BruteForce::Hit{};
        pixel.push_back(hit.pixel);
        delta.at(0, 0, p, k) = hit.delta / t.at("range").at(0, 0, 0, 0);
        u.at(0, 0, p, k) = z > 0 && direction != Vec3(0) ? hit.pixel < 0 ? 1 : std::tanh(10 * delta.at(0, 0, p, k)) : 0;
      }
    return std::vector<Tensor>{Tensor::of_int({1, 1, 42, 16}, pixel), delta, u};
  };
  OpCase rays{.stem = "ssrt",
              .label = "from_surfaces",
              .kernels = {"ssrt", "pyramid_base", "pyramid_level"},
              .inputs = inputs,
              .build = build,
              .reference = reference};
  // The depth where a ray enters a cell goes through the clip, two divisions and the slope of k; delta is their
  // difference and u ten times that.
  rays.roundings = 200, rays.magnitude = 1;
  rays.no_gradient = "cells are discrete";
  return {rays};
}

}  // namespace
}  // namespace clerestory
