// Directions that the samplers of kernels/lib/ggx.clh draw, written again in double as their papers have them.
#pragma once
#include <cmath>

#include "checks/shade/surface_reference.hpp"

namespace clerestory::sampler_reference {

enum { kCaps, kHemisphere, kBounded, kNdf, kCosine, kUniform, kNdfRoughness = 7 };

/// Where `v` turns lead from the azimuth opposite to the view's.
inline double azimuth_of(const Vec3& wo, double v) { return std::atan2(-wo.y, -wo.x) + 2 * M_PI * v; }

inline Vec3 by_azimuth(double across, double azimuth, double z) {
  return {across * std::cos(azimuth), across * std::sin(azimuth), z};
}

/// Dupuy and Benyoub 2023, as in their listing: cosine of the cap by (1 - u)(1 + w.z) - w.z; `bound` below 1 is that of
/// Eto and Tokuyoshi 2023, by which they lower the cap.
inline Vec3 normal_by_cap(const Vec3& wo, double alpha, double u, double v, double bound = 1) {
  const Vec3 w = glm::normalize(Vec3(alpha * wo.x, alpha * wo.y, wo.z));
  const double z = (1 - u) * (1 + bound * w.z) - bound * w.z, r = std::sqrt(std::max(0.0, 1 - z * z));
  const Vec3 h = by_azimuth(r, azimuth_of(wo, v), z) + w;
  return glm::normalize(Vec3(alpha * h.x, alpha * h.y, h.z));
}

inline double bound_of(const Vec3& wo, double alpha) {
  const double a2 = alpha * alpha, s = 1 + std::sqrt(wo.x * wo.x + wo.y * wo.y);
  return (1 - a2) * s * s / (s * s + a2 * wo.z * wo.z);
}

/// Heitz 2018, as in his listing.
inline Vec3 normal_by_hemisphere(const Vec3& wo, double alpha, double u, double v) {
  const Vec3 w = glm::normalize(Vec3(alpha * wo.x, alpha * wo.y, wo.z));
  const Vec3 t1 = glm::normalize(Vec3(-w.y, w.x, 0)), t2 = glm::cross(w, t1);
  const double x = std::sqrt(u) * std::cos(2 * M_PI * v), s = (1 + w.z) / 2;
  const double y = (1 - s) * std::sqrt(1 - x * x) + s * std::sqrt(u) * std::sin(2 * M_PI * v);
  const Vec3 n = x * t1 + y * t2 + std::sqrt(std::max(0.0, 1 - x * x - y * y)) * w;
  return glm::normalize(Vec3(alpha * n.x, alpha * n.y, std::max(n.z, 0.0)));
}

/// The x below which the density 1/2 + |2 x - 1| has the share u.
inline double roughness_quantile(double u) {
  return u < 0.5 ? (1.5 - std::sqrt(2.25 - 4 * u)) / 2 : 1 - roughness_quantile(1 - u);
}

/// `lobe` below the probability p of the specular lobe draws that, of samplers that are mixtures.
inline Vec3 drawn(int sampler, const SurfaceReference& surface, const Vec3& wo, double p, double u, double v,
                  double lobe) {
  if (sampler == kUniform) return by_azimuth(std::sqrt(u * (2 - u)), 2 * M_PI * v, 1 - u);
  if (sampler == kCosine || lobe >= p) return by_azimuth(std::sqrt(u), azimuth_of(wo, v), std::sqrt(1 - u));
  const double alpha = surface.alpha();
  const LobeChart chart{alpha};
  const Vec3 h = sampler == kHemisphere     ? normal_by_hemisphere(wo, alpha, u, v)
                 : sampler == kBounded      ? normal_by_cap(wo, alpha, u, v, bound_of(wo, alpha))
                 : sampler == kNdf          ? chart.half_vector(u, 2 * M_PI * v)
                 : sampler == kNdfRoughness ? chart.half_vector(roughness_quantile(u), 2 * M_PI * v)
                                            : normal_by_cap(wo, alpha, u, v);
  return 2 * glm::dot(wo, h) * h - wo;
}

}  // namespace clerestory::sampler_reference
