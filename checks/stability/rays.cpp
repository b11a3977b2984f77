// Screen-space rays over depth maps of any scale and shape, and what they feed.
#include <algorithm>
#include <cmath>

#include "checks/stability/stability_case.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/ops/light/project_rays.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory {
namespace {

constexpr int kSamples = 16;
constexpr int kMostRows = 6144;  // rays of so many pixels are traced

struct Seen {
  Tensor depth, normal, camera, range;
};

Seen room(int width, int height, double unit = 1) {
  const BenchRoom r = bench_room(width, height);
  Seen seen{r.depth, r.normal, camera_tensor(std::span(&r.camera, 1)), {}};
  for (double& z : seen.depth.real) z *= unit;
  seen.range = depth_range(seen.depth);
  return seen;
}

Tensor crop(const Tensor& map, int left, int top, int width, int height) {
  Tensor part(Shape{1, map.shape.c, height, width});
  for (int c = 0; c < map.shape.c; ++c)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) part.at(0, c, y, x) = map.at(0, c, top + y, left + x);
  return part;
}

/// A part of what the camera sees.
Seen part(Seen seen, int left, int top, int width, int height) {
  seen.depth = crop(seen.depth, left, top, width, height), seen.normal = crop(seen.normal, left, top, width, height);
  seen.camera.at(0, 2, 0, 0) -= left, seen.camera.at(0, 3, 0, 0) -= top;
  seen.range = depth_range(seen.depth);
  return seen;
}

Tensor directions_of(const Seen& seen) {
  const int rows = static_cast<int>(std::min<long>(seen.depth.shape.plane(), kMostRows));
  return random_tensor({1, 3, rows, kSamples}, 3);
}

/// Cells as numbers that differ where the cells do.
Tensor numbers_of(const Tensor& cells) {
  Tensor numbers(cells.shape);
  std::ranges::transform(cells.integer, numbers.real.begin(), [](int cell) { return cell + 2.0; });
  return numbers;
}

/// Cells that rays meet; delta and u, both shares of one scale, beside that: 1 + delta, 1 + u.
StabilityCase traced(const std::string& name, const Seen& seen, const Tensor& directions, bool inside = true) {
  Formula f{.inputs = {{"depth", seen.depth},
                       {"normal", seen.normal},
                       {"camera", seen.camera},
                       {"range", seen.range},
                       {"directions", directions}}};
  f.build = [](Graph&, const Values& v) {
    const SsrtHits hits =
        ssrt(ssrt_scene(v.at("depth"), v.at("normal")), v.at("camera"), v.at("range"), v.at("directions"));
    return std::vector<Compared>{{hits.pixel, false}, {hits.delta, false}, {hits.u, false}};
  };
  StabilityCase c{.group = "rays", .name = name, .inside = inside};
  c.evaluate = [f](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    found.values[0].tensor = numbers_of(found.values[0].tensor);
    for (const std::size_t share : {1, 2})
      for (double& x : found.values[share].tensor.real) x += 1;
    return found;
  };
  return c;
}

/// Along the axes, both ways.
Tensor along_axes(const Seen& seen) {
  Tensor directions = directions_of(seen);
  std::ranges::fill(directions.real, 0);
  for (int p = 0; p < directions.shape.h; ++p)
    for (int s = 0; s < kSamples; ++s) directions.at(0, s % 3, p, s) = s % 2 ? 1 : -1;
  return directions;
}

Seen with_holes(Seen seen, double hole) {
  for (std::size_t i = 0; i < seen.depth.real.size(); i += 5) seen.depth.real[i] = hole;
  return seen;
}

StabilityCase projected(const std::string& name, const Tensor& directions) {
  const Seen seen = room(96, 64);
  Formula f{.inputs = {{"camera", seen.camera}, {"directions", directions}}};
  f.build = [shape = seen.depth.shape](Graph&, const Values& v) {
    return std::vector<Compared>{{project_rays(v.at("directions"), v.at("camera"), shape), false}};
  };
  StabilityCase c{.group = "rays", .name = name};
  c.evaluate = [f](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    found.values[0].tensor = numbers_of(found.values[0].tensor);
    return found;
  };
  return c;
}

}  // namespace

std::vector<StabilityCase> ray_stability() {
  const Seen usual = room(96, 64), large = room(1024, 1024);
  const auto anywhere = [](const std::string& name, const Seen& seen, bool inside = true) {
    return traced(name, seen, directions_of(seen), inside);
  };
  std::vector<StabilityCase> cases{anywhere("a room of 96x64", usual),
                                   anywhere("holes", with_holes(usual, 0)),
                                   anywhere("depth Inf in some pixels", with_holes(usual, INFINITY), false),
                                   anywhere("depth NaN in some pixels", with_holes(usual, NAN), false),
                                   anywhere("depth negative in some pixels", with_holes(usual, -1), false),
                                   anywhere("depth 1e-6", room(96, 64, 1e-6)),
                                   anywhere("depth 1e6", room(96, 64, 1e6)),
                                   anywhere("one pixel", room(1, 1)),
                                   anywhere("one pixel wide", part(large, 300, 0, 1, 1024)),
                                   anywhere("one pixel high", part(large, 0, 700, 1024, 1)),
                                   anywhere("one pixel wide, 179.9 degrees high", room(1, 1024), false),
                                   anywhere("65535 pixels wide", room(65535, 2)),
                                   traced("along the axes", usual, along_axes(usual)),
                                   traced("no direction", usual, Tensor(directions_of(usual).shape, 0))};
  Tensor aside = directions_of(usual);
  for (std::size_t i = 0; i < aside.real.size(); ++i)
    if (static_cast<long>(i) / (aside.shape.h * aside.shape.w) == 2) aside.real[i] *= 1e-30;
  cases.push_back(projected("projected", directions_of(usual)));
  cases.push_back(projected("projected from beside the camera", aside));
  return cases;
}

}  // namespace clerestory
