// Screen-space rays against brute force over all cells.
#include "host/ops/light/ssrt.hpp"

#include <cmath>
#include <optional>

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

enum class From { Surfaces, Map, Anywhere };

struct Variant {
  From from = From::Surfaces;
  bool facing = false;
  SsrtOptions options;

  std::string label() const {
    std::string text = from == From::Surfaces ? "from_surfaces" : from == From::Map ? "from_a_map" : "from_anywhere";
    if (options.solver == SsrtSolver::Dda) text += "_dda";
    if (facing) text += "_facing";
    if (options.delta == DeltaDepth::Window) text += "_window";
    if (options.thickness > 0) text += "_thick";
    if (options.lanes > 0) text += fmt::format("_{}_lanes", options.lanes);
    return text;
  }
};

constexpr int kHeight = 6, kWidth = 7, kPixels = kHeight * kWidth;

Tensors inputs(const Variant& v) {
  const Scene scene = scene_of(1, kHeight, kWidth, 30);
  Tensors in{{"depth", scene.depth},
             {"camera", scene.cameras()},
             {"range", depth_range(scene.depth)},
             {"directions", directions(kPixels, 31)}};
  if (v.facing) in["normal"] = scene.normal;
  if (v.from == From::Map) {
    in["points"] = random_tensor({1, 3, kHeight, kWidth}, 32);
    for (int p = 0; p < kPixels; ++p) in["points"].at(0, 2, p / kWidth, p % kWidth) -= 1.5;
    in["skip"] = random_ints({1, 1, kHeight, kWidth}, 33, -1, kPixels);
  }
  if (v.from == From::Anywhere) {
    const Rays rays = rays_from_anywhere(kPixels, 34, kPixels);
    in["directions"] = rays.directions, in["points"] = rays.points, in["skip"] = rays.skip;
  }
  return in;
}

/// Where ray k of pixel p starts, and the pixel that it does not hit; nothing where the pixel has no surface.
std::optional<std::pair<Vec3, int>> start_of(const Variant& v, const Tensors& t, int p, int k) {
  const int y = p / kWidth, x = p % kWidth;
  if (v.from == From::Surfaces) {
    const double z = t.at("depth").at(0, 0, y, x);
    if (z == 0) return {};
    return std::pair{camera_in(t).unproject(x + 0.5, y + 0.5, z), p};
  }
  const Tensor& points = t.at("points");
  Vec3 start;
  for (int c = 0; c < 3; ++c) start[c] = v.from == From::Map ? points.at(0, c, y, x) : points.at(0, c, p, k);
  return std::pair{start, t.at("skip").integer[static_cast<std::size_t>(v.from == From::Map ? p : p * 16 + k)]};
}

std::vector<Tensor> reference(const Variant& v, const Tensors& t) {
  const Tensor &depth = t.at("depth"), &d = t.at("directions");
  const BruteForce brute{camera_in(t), &depth, v.facing ? &t.at("normal") : nullptr, 0, v.options.thickness};
  std::vector<int> pixel;
  Tensor delta(Shape{1, 1, kPixels, 16}), u(Shape{1, 1, kPixels, 16});
  for (int p = 0; p < kPixels; ++p)
    for (int k = 0; k < 16; ++k) {
      const auto start = start_of(v, t, p, k);
      const Vec3 direction{d.at(0, 0, p, k), d.at(0, 1, p, k), d.at(0, 2, p, k)};
      const BruteForce::Hit hit = start ? brute.trace(start->first, direction, start->second) : BruteForce::Hit{};
      pixel.push_back(hit.pixel);
      delta.at(0, 0, p, k) = gap_of(hit, t.at("range"), 0, v.options.delta);
      if (start && direction != Vec3(0)) u.at(0, 0, p, k) = hit.pixel < 0 ? 1 : std::tanh(10 * delta.at(0, 0, p, k));
    }
  return {Tensor::of_int({1, 1, kPixels, 16}, pixel), delta, u};
}

/// Rays whose cells are the same in float (the tests' EqualsBruteForce... tell how seldom that is not so).
OpCase rays_case(const Variant& variant) {
  OpCase c{.stem = "ssrt", .label = variant.label(), .kernels = {"ssrt", "pyramid_base", "pyramid_level"}};
  c.inputs = inputs(variant);
  c.build = [=](Graph&, const Values& v) {
    const Value normal = variant.facing ? v.at("normal") : Value{};
    const RayOrigins origins = variant.from == From::Surfaces
                                   ? RayOrigins{}
                                   : RayOrigins{v.at("points"), v.at("skip"), variant.from == From::Map};
    const SsrtHits hits = ssrt(ssrt_scene(v.at("depth"), normal), v.at("camera"), v.at("range"), v.at("directions"),
                               origins, variant.options);
    return std::vector<Value>{hits.pixel, hits.delta, hits.u};
  };
  c.reference = [=](const Tensors& t) { return reference(variant, t); };
  // The depth where a ray enters a cell goes through the clip, two divisions and the slope of k; delta is their
  // difference and u ten times that.
  c.roundings = 200, c.magnitude = 1;
  c.no_gradient = "cells are discrete";
  return c;
}

OP_CASES(light_ssrt) {
  std::vector<OpCase> cases{rays_case({})};
  for (const SsrtSolver solver : {SsrtSolver::Hierarchical, SsrtSolver::Dda})
    for (const bool facing : {false, true}) {
      for (const DeltaDepth delta : {DeltaDepth::Linear, DeltaDepth::Window})
        for (const From from : {From::Surfaces, From::Anywhere})
          if (const Variant v{from, facing, {.solver = solver, .delta = delta}}; v.label() != "from_surfaces")
            cases.push_back(rays_case(v));
      cases.push_back(rays_case({From::Map, facing, {.solver = solver}}));
      cases.push_back(rays_case({From::Surfaces, facing, {.solver = solver, .thickness = 0.3}}));
    }
  for (const int lanes : {1, 4, 8}) cases.push_back(rays_case({From::Surfaces, true, {.lanes = lanes}}));
  for (std::size_t i = 1; i < cases.size(); ++i) cases[i].in_tests = false;  // their own are larger
  return cases;
}

}  // namespace
}  // namespace clerestory
