#include "checks/shade/surface_reference.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {

double SurfaceReference::d(const Vec3& h) const {
  // 1 - z^2 from the tangent components: in double, the textbook form loses eight digits at alpha = 1e-4.
  const double a2 = alpha() * alpha();
  const double q = (h.x * h.x + h.y * h.y + a2 * h.z * h.z) / glm::dot(h, h);
  return a2 / (M_PI * q * q);
}

Vec3 SurfaceReference::f_cos(const Vec3& wo, const Vec3& wi) const {
  if (wi.z <= 0 || wo.z <= 0) return Vec3(0);
  const Vec3 h = glm::normalize(wo + wi);
  const double a2 = alpha() * alpha();
  const auto lambda = [&](const Vec3& w) {
    const double tan2 = a2 * (w.x * w.x + w.y * w.y) / (w.z * w.z);
    return tan2 / (2 * (1 + std::sqrt(1 + tan2)));
  };
  const double g2 = 1 / (1 + lambda(wo) + lambda(wi));
  const Vec3 f = f0() + (1.0 - f0()) * std::pow(1 - glm::dot(wo, h), 5);
  const Vec3 specular = f * (d(h) * g2 / (4 * wo.z * wi.z));
  return diffuse_f_cos(wi) + specular * wi.z;
}

Vec3 SurfaceReference::diffuse_f_cos(const Vec3& wi) const { return albedo * ((1 - metallic) / M_PI * wi.z); }

Vec3 SurfaceReference::specular_share(const Vec3& wo, const Vec3& wi) const {
  const Vec3 whole = f_cos(wo, wi);
  return (whole - diffuse_f_cos(wi)) / whole;
}

double SurfaceReference::specular_probability(const Vec3& wo) const {
  const auto luminance = [](const Vec3& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; };
  const Vec3 f = f0() + (1.0 - f0()) * std::pow(1 - wo.z, 5);
  const double s = std::max(luminance(f), 0.01), diffuse = std::max(luminance(albedo * (1 - metallic)), 0.01);
  return std::min(s / (s + diffuse), 0.9);
}

double SurfaceReference::specular_pdf(int sampler, const Vec3& wo, const Vec3& wi) const {
  const Vec3 h = glm::normalize(wo + wi);
  const double a = alpha(), across = a * a * (wo.x * wo.x + wo.y * wo.y);
  const double t = std::sqrt(across + wo.z * wo.z);
  if (sampler == 3) return d(h) * h.z / (4 * glm::dot(wo, h));
  if (sampler == 7) return d(h) * h.z / (4 * glm::dot(wo, h)) * (0.5 + std::abs(2 * LobeChart{a}.u(h) - 1));
  if (sampler == 2) {  // Eto and Tokuyoshi 2023, listing of the density
    const double s = 1 + std::sqrt(wo.x * wo.x + wo.y * wo.y);
    const double k = (1 - a * a) * s * s / (s * s + a * a * wo.z * wo.z);
    return d(h) / (2 * (k * wo.z + t));
  }
  const double g1 = 2 / (1 + std::sqrt(1 + across / (wo.z * wo.z)));
  return g1 * std::max(glm::dot(wo, h), 0.0) * d(h) / wo.z / (4 * glm::dot(wo, h));
}

double SurfaceReference::pdf(int sampler, const Vec3& wo, const Vec3& wi, double p) const {
  if (wi.z <= 0) return 0;
  if (sampler == 5) return 0.5 / M_PI;
  if (sampler == 4) return wi.z / M_PI;
  return p * specular_pdf(sampler, wo, wi) + (1 - p) * wi.z / M_PI;
}

Vec3 LobeChart::half_vector(double u, double turn) const {
  const double c = std::sqrt(1 - u), s = alpha * std::sqrt(u), length = std::sqrt(c * c + s * s);
  return Vec3(s * std::cos(turn), s * std::sin(turn), c) / length;
}

double LobeChart::u(const Vec3& h) const {
  const double tan2 = (h.x * h.x + h.y * h.y) / (h.z * h.z);
  return tan2 / (alpha * alpha + tan2);
}

double SurfaceReference::directions_per_chart(const Vec3& wo, const Vec3& h) const {
  return 4 * glm::dot(wo, h) / (2 * M_PI * d(h) * h.z);
}

Vec3 SurfaceReference::directional_albedo(const Vec3& wo, int u_cells, int turn_cells) const {
  const LobeChart chart{alpha()};
  Vec3 sum(0);
  for (int i = 0; i < u_cells; ++i)
    for (int j = 0; j < turn_cells; ++j) {
      // u = 1 - (1 - x)^2 puts cells where rough lobes end.
      const double x = (i + 0.5) / u_cells, u = 1 - (1 - x) * (1 - x), stretch = 2 * (1 - x);
      const Vec3 h = chart.half_vector(u, 2 * M_PI * (j + 0.5) / turn_cells);
      const double across = glm::dot(wo, h);
      const Vec3 wi = 2 * across * h - wo;
      if (across <= 0 || wi.z <= 0) continue;
      const Vec3 specular = f_cos(wo, wi) - diffuse_f_cos(wi);
      sum += specular * (directions_per_chart(wo, h) * stretch * 2 * M_PI / (u_cells * turn_cells));
    }
  return sum + albedo * (1 - metallic);
}

Vec3 view_of(double c) {
  const double s = std::sqrt(1 - c * c);
  return {s * std::cos(0.7), s * std::sin(0.7), c};
}

}  // namespace clerestory
