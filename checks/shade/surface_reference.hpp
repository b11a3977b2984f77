// The surface model written again in double, in its textbook form with normalised half vectors.
#pragma once
#include <algorithm>
#include <vector>

#include "host/math/vec.hpp"

namespace clerestory {

/// Half vectors by (u, azimuth), u = tan^2 / (alpha^2 + tan^2): GGX's own normals are uniform there at any alpha, so a
/// lobe of any width fills the same cells, and integrals over it are smooth.
struct LobeChart {
  double alpha;
  Vec3 half_vector(double u, double turn) const;
  double u(const Vec3& h) const;
};

struct SurfaceReference {
  Vec3 albedo{0.5};
  double roughness = 0.5, metallic = 0;

  std::vector<double> values() const { return {albedo.x, albedo.y, albedo.z, roughness, metallic}; }
  double alpha() const { return std::max(roughness * roughness, 1e-4); }
  Vec3 f0() const { return glm::mix(Vec3(0.04), albedo, metallic); }
  /// Density of half vectors, unit h.
  double d(const Vec3& h) const;
  /// f cos(wi); local frame.
  Vec3 f_cos(const Vec3& wo, const Vec3& wi) const;
  Vec3 diffuse_f_cos(const Vec3& wi) const;                   // its Lambertian part, wi above the surface
  Vec3 specular_share(const Vec3& wo, const Vec3& wi) const;  // of the rest, in the whole
  double specular_probability(const Vec3& wo) const;
  /// Density of a direction of the specular lobe (samplers 0 to 3 and 7 of ggx.clh).
  double specular_pdf(int sampler, const Vec3& wo, const Vec3& wi) const;
  /// Density of a sampler (0 to 5, 7); p: probability of the specular lobe.
  double pdf(int sampler, const Vec3& wo, const Vec3& wi, double p) const;
  /// Solid angle of wi for du dazimuth of the chart at the half vector h: 4 (wo.h) / (2 pi D cos).
  double directions_per_chart(const Vec3& wo, const Vec3& h) const;
  /// Reflected part of light 1 from everywhere: quadrature over the chart of half vectors; the diffuse part is exact.
  Vec3 directional_albedo(const Vec3& wo, int u_cells, int turn_cells) const;
};

/// A view at cosine c, turned so that no component is special.
Vec3 view_of(double c);

}  // namespace clerestory
