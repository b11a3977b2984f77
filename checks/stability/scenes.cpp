// Whole pictures rendered again: surfaces, rays, light and sums together, and back.
#include <cmath>

#include "checks/stability/stability_case.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/shade/render.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 32, kHeight = 24;

/// A furnished room that is its own light.
Tensors room(double roughness, double metallic, const Tensor& image, double ambient) {
  const BenchRoom r = bench_room(kWidth, kHeight);
  Tensor material(Shape{1, 2, kHeight, kWidth});
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) material.at(0, 0, y, x) = roughness, material.at(0, 1, y, x) = metallic;
  return {{"depth", r.depth},
          {"normal", r.normal},
          {"albedo", random_tensor({1, 3, kHeight, kWidth}, 1, 0.2, 0.9)},
          {"material", material},
          {"camera", camera_tensor(std::span(&r.camera, 1))},
          {"range", depth_range(r.depth)},
          {"image", image},
          {"ambient", Tensor(Shape{1, 3, 1, 1}, ambient)}};
}

StabilityCase rendered(const std::string& name, const Tensors& maps) {
  Formula f{.inputs = maps};
  f.build = [](Graph& g, const Values& v) {
    const LightBuilder light = [](Graph&, const RayBatch& rays, std::span<const Value> in) {
      return image_light(in[0], in[1], rays.hits.pixel);
    };
    const Rendered r = render(g, {.spp = 32}, {v.at("depth"), {v.at("albedo"), v.at("normal"), v.at("material")}},
                              v.at("camera"), v.at("range"), std::vector{v.at("image"), v.at("ambient")}, light);
    return std::vector<Compared>{{r.radiance}, {r.uncertainty, false}, {r.tally, false}};
  };
  f.differentiate = {"albedo", "normal", "material", "image"};
  StabilityCase c{.group = "scenes", .name = name};
  c.evaluate = [f](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    for (Evaluated& e : found.gradients) e.sums = true;  // over a pixel's rays
    const Tensor& tally = found.values[2].tensor;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) found.dropped += tally.at(0, 2, y, x);
    return found;
  };
  return c;
}

/// A picture of `all` but for one pixel of the ceiling.
Tensor one_pixel(double all, double one) {
  Tensor image(Shape{1, 3, kHeight, kWidth}, all);
  for (int c = 0; c < 3; ++c) image.at(0, c, 2, 15) = one;
  return image;
}

}  // namespace

std::vector<StabilityCase> scene_stability() {
  const Tensor usual = random_tensor({1, 3, kHeight, kWidth}, 2, 0.1, 1);
  return {rendered("a usual room", room(0.4, 0.2, usual, 0.3)),
          rendered("pitch dark", room(0.4, 0.2, one_pixel(0, 0), 0)),
          rendered("one tiny lamp, a pixel of 1e4", room(0.4, 0.2, one_pixel(0, 1e4), 0)),
          rendered("one white pixel", room(0.4, 0.2, one_pixel(0, 1), 0)),
          rendered("all mirrors", room(0, 1, usual, 0.3)),
          rendered("all mirrors under one tiny lamp", room(0, 1, one_pixel(0.01, 1e4), 0.01))};
}

}  // namespace clerestory
