// Objects before the scene or behind it, by the distance along the ray.
#include "host/ops/shade/nearer.hpp"

#include "checks/op_case.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 5, kHeight = 4, kRows = kWidth * kHeight, kSamples = 16;

Tensors inputs(bool per_pixel) {
  const Camera camera = Camera::from_fov(kWidth, kHeight, 70.0);
  const Shape rays{1, 3, kRows, kSamples}, one{1, 1, kRows, kSamples};
  return {{"points", random_tensor(per_pixel ? Shape{1, 3, kHeight, kWidth} : rays, 1)},
          {"direction", random_tensor(rays, 2)},
          {"hit", random_ints(one, 3, -1, kRows - 1)},
          {"object", random_ints(one, 4, -1, 2)},
          {"distance", random_tensor(one, 5, 0, 4)},
          {"scene", random_tensor(rays, 6, 0, 2)},
          {"weight", random_tensor(rays, 7, 0, 2)},
          {"beyond", random_tensor(rays, 8, 0, 2)},
          {"depth", random_tensor({1, 1, kHeight, kWidth}, 9, 0.5, 3)},
          {"camera", camera_tensor(std::span(&camera, 1))},
          {"shows", [] {
             Tensor shows(Shape{1, 1, kHeight, kWidth});
             for (int k = 0; k < kRows; k += 3) shows.at(0, 0, k / kWidth, k % kWidth) = 1;
             return shows;
           }()}};
}

std::vector<Tensor> reference(const Tensors& t, bool per_pixel, bool difference) {
  Camera camera;
  const Tensor& v = t.at("camera");
  camera.fx = v.at(0, 0, 0, 0), camera.fy = v.at(0, 1, 0, 0), camera.cx = v.at(0, 2, 0, 0),
  camera.cy = v.at(0, 3, 0, 0);
  Tensor radiance(Shape{1, 3, kRows, kSamples});
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < kSamples; ++s) {
      const auto i = static_cast<std::size_t>(p * kSamples + s);
      const int hit = t.at("hit").integer[i], x = p % kWidth, y = p / kWidth;
      Vec3 from, d;
      for (int c = 0; c < 3; ++c) {
        from[c] = per_pixel ? t.at("points").at(0, c, y, x) : t.at("points").at(0, c, p, s);
        d[c] = t.at("direction").at(0, c, p, s);
      }
      bool before = t.at("object").integer[i] >= 0;
      if (before && hit >= 0) {
        const Vec3 seen = camera.unproject(hit % kWidth + 0.5, hit / kWidth + 0.5,
                                           t.at("depth").at(0, 0, hit / kWidth, hit % kWidth));
        before = t.at("distance").at(0, 0, p, s) < glm::dot(seen - from, d) / glm::dot(d, d);
      }
      for (int c = 0; c < 3; ++c) {
        const double scene = t.at("scene").at(0, c, p, s);
        const double shown = before ? t.at("weight").at(0, c, p, s) * t.at("beyond").at(0, c, p, s) : scene;
        radiance.at(0, c, p, s) = shown - (difference && t.at("shows").at(0, 0, y, x) == 0 ? scene : 0);
      }
    }
  return {radiance};
}

OP_CASES(nearer) {
  std::vector<OpCase> cases;
  for (const bool per_pixel : {false, true})
    for (const bool difference : {false, true}) {
      OpCase c{.stem = "nearer",
               .label = fmt::format("{}_{}", per_pixel ? "pixels" : "rays", difference ? "difference" : "whole"),
               .kernels = {"nearer"},
               .inputs = inputs(per_pixel)};
      c.build = [per_pixel, difference](Graph&, const Values& v) {
        const NearerRays rays{v.at("points"), v.at("direction"), v.at("hit"),
                              v.at("object"), v.at("distance"),  per_pixel};
        return std::vector<Value>{nearer(rays, v.at("scene"), v.at("weight"), v.at("beyond"), v.at("depth"),
                                         v.at("camera"), difference ? v.at("shows") : Value{})};
      };
      c.reference = [=](const Tensors& t) { return reference(t, per_pixel, difference); };
      c.roundings = 4;
      c.no_gradient = "for applications, detached";
      cases.push_back(c);
    }
  OpCase needed{.stem = "nearer", .label = "needed", .kernels = {"needed_rays"}, .inputs = inputs(true)};
  needed.build = [](Graph&, const Values& v) {
    return std::vector<Value>{needed_rays(v.at("direction"), v.at("object"), v.at("shows"))};
  };
  needed.reference = [](const Tensors& t) {
    Tensor kept = t.at("direction");
    for (int p = 0; p < kRows; ++p)
      for (int s = 0; s < kSamples; ++s)
        if (t.at("object").integer[static_cast<std::size_t>(p * kSamples + s)] < 0 &&
            t.at("shows").at(0, 0, p / kWidth, p % kWidth) == 0)
          for (int c = 0; c < 3; ++c) kept.at(0, c, p, s) = 0;
    return std::vector<Tensor>{kept};
  };
  needed.no_gradient = "for applications, detached";
  cases.push_back(needed);
  return cases;
}

}  // namespace
}  // namespace clerestory
