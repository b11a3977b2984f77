// Independent references in plain double arithmetic, written from the formulas and not from the kernels.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

namespace clerestory::reference {

using V = glm::dvec3;

struct Brdf {
  V albedo{0.5};
  double roughness = 0.5, metallic = 0;

  double alpha() const { return std::max(roughness * roughness, 1e-4); }

  /// f of unit wi, wo about normal (0, 0, 1): A(1-M)/pi + D G2 F / (4 cos cos), D as GGX by the cosine of the half
  /// vector, G2 height-correlated by Smith's lambda (Heitz 2014, equations 72 and 99).
  V operator()(const V& wi, const V& wo) const {
    if (wi.z <= 0 || wo.z <= 0) return V(0);
    const double a2 = alpha() * alpha();
    const V h = glm::normalize(wi + wo);
    const double c2 = h.z * h.z, t2 = (1 - c2) / c2;
    const double d = 1 / (std::numbers::pi * a2 * c2 * c2 * std::pow(1 + t2 / a2, 2));
    const auto lambda = [a2](const V& w) { return 0.5 * (std::sqrt(1 + a2 * (1 - w.z * w.z) / (w.z * w.z)) - 1); };
    const double g2 = 1 / (1 + lambda(wi) + lambda(wo));
    const V f0 = 0.04 * (1 - metallic) + albedo * metallic;
    const V fresnel = f0 + (1.0 - f0) * std::pow(1 - glm::dot(wi, h), 5);
    return albedo * (1 - metallic) / std::numbers::pi + d * g2 / (4 * wi.z * wo.z) * fresnel;
  }
};

/// Integral over the upper hemisphere of g(direction), midpoint rule in cosine and azimuth.
template <class Function>
auto over_hemisphere(Function g, int rows = 400, int columns = 400) {
  decltype(g(V(0))) sum{0};
  for (int i = 0; i < rows; ++i) {
    const double z = (i + 0.5) / rows, r = std::sqrt(1 - z * z);
    for (int k = 0; k < columns; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / columns;
      sum += g(V(r * std::cos(phi), r * std::sin(phi), z));
    }
  }
  return sum * (2 * std::numbers::pi / rows / columns);
}

}  // namespace clerestory::reference
