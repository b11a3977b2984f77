// Independent references in plain double arithmetic, written from the formulas and not from the kernels.
#pragma once
#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <vector>

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

/// Radiance leaving the wall of a closed sphere, each point of which emits 1 and reflects, at cosine c, by iterating
/// the integral equation: a chord meets the sphere at the same angle on both ends, so L(c) = 1 + int f(c, c') L(c')
/// cos' dw', over so many scatterings.
class Furnace {
 public:
  explicit Furnace(const Brdf& brdf, int scatterings = 400) {
    constexpr int azimuths = 64;
    std::vector<double> kernel(kNodes * kNodes);
    for (int i = 0; i < kNodes; ++i) {
      const double co = cosine(i), so = std::sqrt(1 - co * co);
      for (int k = 0; k < kNodes; ++k) {
        const double ci = cosine(k), si = std::sqrt(1 - ci * ci);
        double sum = 0;
        for (int a = 0; a < azimuths; ++a) {
          const double phi = 2 * std::numbers::pi * (a + 0.5) / azimuths;
          sum += brdf({si * std::cos(phi), si * std::sin(phi), ci}, {so, 0, co}).x;
        }
        kernel[static_cast<std::size_t>(i * kNodes + k)] = sum * 2 * std::numbers::pi / azimuths * ci / kNodes;
      }
    }
    radiance_.assign(kNodes, 1);
    for (int pass = 0; pass < scatterings; ++pass) {
      std::vector<double> next(kNodes, 1);
      for (std::size_t i = 0; i < kNodes; ++i) {
        for (std::size_t k = 0; k < kNodes; ++k) next[i] += kernel[i * kNodes + k] * radiance_[k];
      }
      radiance_ = next;
    }
  }
  double at(double c) const {
    const double x = std::clamp(c * kNodes - 0.5, 0.0, kNodes - 1.001);
    const int i = static_cast<int>(x);
    return radiance_[static_cast<std::size_t>(i)] * (1 - (x - i)) +
           radiance_[static_cast<std::size_t>(i) + 1] * (x - i);
  }

 private:
  static constexpr int kNodes = 256;
  static double cosine(int i) { return (i + 0.5) / kNodes; }
  std::vector<double> radiance_;
};

}  // namespace clerestory::reference
