// What cases and tests of the op that draws directions share: maps, and weights written again.
#pragma once
#include <cmath>
#include <limits>
#include <random>

#include "checks/op_case.hpp"
#include "checks/shade/surface_reference.hpp"
#include "host/ops/light/ssrt.hpp"

namespace clerestory::sample_brdf_reference {

inline constexpr int kBatch = 2, kHeight = 3, kWidth = 4, kPlane = kHeight * kWidth, kRows = kBatch * kPlane;

inline Camera camera() { return Camera::from_fov(kWidth, kHeight, 75.0); }

/// Maps with a hole in the depth and a normal that faces away.
inline Tensors maps(unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Tensor n(Shape{kBatch, 3, kHeight, kWidth});
  for (int b = 0; b < kBatch; ++b)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Vec3 v = glm::normalize(-camera().direction(x + 0.5, y + 0.5) +
                                      0.6 * Vec3(normal(random), normal(random), normal(random)));
        for (int c = 0; c < 3; ++c) n.at(b, c, y, x) = 1.3 * v[c];  // not unit: maps that were resized are not
      }
  for (int c = 0; c < 3; ++c) {
    n.at(1, c, 2, 3) = -(c == 2);
    // Where frames turn over: n.z = 0, and an n.y that is far from 0 but within the grid's 0.999.
    n.at(0, c, 0, 0) = Vec3(1, 0, 0)[c], n.at(0, c, 0, 1) = Vec3(0.1, -0.96, 0.27)[c];
  }
  Tensor depth = random_tensor({kBatch, 1, kHeight, kWidth}, seed + 1, 1, 3);
  depth.at(0, 0, 1, 1) = 0, depth.at(0, 0, 2, 2) = std::numeric_limits<double>::infinity();
  return {{"normal", n},
          {"depth", depth},
          {"albedo", random_tensor({kBatch, 3, kHeight, kWidth}, seed + 2, 0, 1)},
          {"material", random_tensor({kBatch, 2, kHeight, kWidth}, seed + 3, 0.4, 1)},
          {"camera", camera_tensor(std::vector<Camera>(kBatch, camera()))}};
}

/// The camera of the inputs, which are rounded to float.
inline Camera camera_in(const Tensors& t) {
  Camera c = camera();
  const Tensor& v = t.at("camera");
  c.fx = v.at(0, 0, 0, 0), c.fy = v.at(0, 1, 0, 0), c.cx = v.at(0, 2, 0, 0), c.cy = v.at(0, 3, 0, 0);
  return c;
}

inline Vec3 pixel_of(const Tensor& map, int p) {
  const int n = p / kPlane, y = p % kPlane / kWidth, x = p % kWidth;
  return {map.at(n, 0, y, x), map.at(n, 1, y, x), map.at(n, 2, y, x)};
}

inline SurfaceReference surface_of(const Tensors& t, const std::string& prefix, int p) {
  const int n = p / kPlane, y = p % kPlane / kWidth, x = p % kWidth;
  const Tensor& material = t.at(prefix + "material");
  return {pixel_of(t.at(prefix + "albedo"), p), material.at(n, 0, y, x), material.at(n, 1, y, x)};
}

/// Li et al.'s model, from the formulas of their program.
inline Vec3 li2020_f_cos_specular(const SurfaceReference& s, const Vec3& wo, const Vec3& wi) {
  const Vec3 h = glm::normalize(wo + wi);
  const double vh = glm::dot(wo, h), a2 = std::pow(s.roughness, 4), k = std::pow(s.roughness + 1, 2) / 8;
  const double f = 0.05 + 0.95 * std::pow(2, (-5.55472 * vh - 6.98316) * vh);
  const double below = 4 * M_PI * std::pow(h.z * h.z * (a2 - 1) + 1, 2) * (wo.z * (1 - k) + k) * (wi.z * (1 - k) + k);
  return Vec3(a2 * f / std::clamp(below, 1e-6, 4 * M_PI) * wi.z);
}

/// f cos, the specular lobe's share of it, and that lobe's own density.
struct Weighed {
  Vec3 f_cos, share;
  double lobe;
};

inline Weighed weigh_li2020(const SurfaceReference& s, const Vec3& wo, const Vec3& wi) {
  const Vec3 specular = li2020_f_cos_specular(s, wo, wi), whole = specular + s.albedo / M_PI * wi.z;
  return {whole, specular / whole, s.specular_pdf(0, wo, wi)};
}

/// The evaluation maps as those that draw, with a row of extreme materials: the lobe is met at its peak.
inline Tensors same_twice(double roughness) {
  Tensors t = maps(20);
  Tensor& material = t["material"];
  material = random_tensor(material.shape, 3, roughness, 1.5 * roughness);
  for (int x = 0; x < kWidth; ++x) {
    material.at(0, 1, 0, x) = x % 2;                                 // dielectric, metal
    for (int k = 0; k < 3; ++k) t["albedo"].at(0, k, 0, x) = x / 2;  // black, white
    material.at(1, 1, 1, x) = 0.2 + 0.2 * x;                         // both lobes
  }
  if (roughness < 0.05) material.at(0, 0, 2, 0) = 0.005;  // below the least alpha: no slope
  for (const char* name : {"normal", "albedo", "material"}) t[std::string("e_") + name] = t[name];
  return t;
}

}  // namespace clerestory::sample_brdf_reference
