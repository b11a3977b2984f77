// Guides written again in double: rows from maps and lamps, their density, and what they draw.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "checks/shade/sample_brdf_reference.hpp"
#include "host/math/frames.hpp"

namespace clerestory::light_guide_reference {

using namespace sample_brdf_reference;

/// Lamps of those maps: ahead, near a surface, aside, one without light, and one far behind.
inline Tensor lamps() {
  constexpr double k[5][5] = {{0.4, -0.2, 1.5, -2.0, 0.0},
                              {0.9, 0.3, 0.0, 2.0, 0.0},
                              {-1.5, -1.8, -2.5, -1.0, 9.0},
                              {0.25, 0.4, 0.5, 0.3, 1.0},
                              {40, 3, 9, 0, 2}};
  Tensor t(Shape{1, 5, 1, 5});
  for (int c = 0; c < 5; ++c)
    for (int i = 0; i < 5; ++i) t.at(0, c, 0, i) = k[c][i];
  return t;
}

/// The same of a first picture; of a second one such that meet both bounds of sharpness: one as wide as a hall, one
/// that is a point.
inline Tensor lamps_of_each_picture() {
  const Tensor first = lamps();
  constexpr double second[5][5] = {{0.5, -0.3, 2.0, 0.0, 1.0},
                                   {0.6, 0.2, 1.0, 0.5, 0.0},
                                   {-1.2, -2.0, -1.5, -9.0, 8.0},
                                   {100, 0.01, 0.4, 0.3, 1.0},
                                   {2, 1e4, 9, 0, 2}};
  Tensor t(Shape{2, 5, 1, 5});
  for (int c = 0; c < 5; ++c)
    for (int i = 0; i < 5; ++i) t.at(0, c, 0, i) = first.at(0, c, 0, i), t.at(1, c, 0, i) = second[c][i];
  return t;
}

struct Lobe {
  Vec3 axis;
  double sharpness, light;
};

inline Lobe lobe_of(const Tensor& known, int n, int k, const Vec3& point, const Vec3& normal) {
  const Vec3 to = Vec3(known.at(n, 0, 0, k), known.at(n, 1, 0, k), known.at(n, 2, 0, k)) - point;
  Lobe lobe{glm::normalize(to), std::clamp(glm::dot(to, to) / std::pow(known.at(n, 3, 0, k), 2), 0.01, 2500.0), 0};
  // Irradiance of exp(-s (1 - cos)) over that of 1 from everywhere, pi.
  const double solid = 2 * M_PI * (1 - std::exp(-2 * lobe.sharpness)) / lobe.sharpness;
  lobe.light =
      known.at(n, 4, 0, k) * std::max(glm::dot(normal, lobe.axis) + 1 / std::sqrt(lobe.sharpness), 0.0) * solid / M_PI;
  return lobe;
}

/// {kRows, 2 + 6 K, 1, 1} of the maps "depth", "normal", "albedo", "material", "camera" and of "lamps".
inline Tensor guide_rows(const Tensors& t) {
  const Tensor& known = t.at("lamps");
  Tensor rows(Shape{kRows, 2 + 6 * known.shape.w, 1, 1});
  for (int p = 0; p < kRows; ++p) {
    const int x = p % kWidth, y = p % kPlane / kWidth;
    const double z = t.at("depth").at(p / kPlane, 0, y, x);
    if (!(z > 0)) continue;
    const Camera eye = camera_in(t);
    const Vec3 normal = glm::normalize(pixel_of(t.at("normal"), p));
    std::vector<Lobe> lobes;
    double all = 0, kept = 0;
    for (int k = 0; k < known.shape.w; ++k) {
      lobes.push_back(
          lobe_of(known, std::min(p / kPlane, known.shape.n - 1), k, eye.unproject(x + 0.5, y + 0.5, z), normal));
      all += lobes.back().light;
    }
    std::erase_if(lobes, [&](const Lobe& lobe) { return !(lobe.light > 0.01 * all); });
    for (const Lobe& lobe : lobes) kept += lobe.light;
    const SurfaceReference s = surface_of(t, "", p);
    const double cosine = glm::dot(normal, -eye.direction(x + 0.5, y + 0.5));
    const double broad = 1 - s.specular_probability({0, 0, cosine}) * (1 - std::min(s.alpha(), 1.0));
    const double chance = 0.6 * broad * all / (1 + all);
    if (!(kept > 0 && chance > 0)) continue;
    rows.at(p, 0, 0, 0) = chance, rows.at(p, 1, 0, 0) = static_cast<double>(lobes.size());
    double sum = 0;
    for (std::size_t k = 0; k < lobes.size(); ++k) {
      const int at = static_cast<int>(2 + 6 * k);
      const double share = chance * lobes[k].light / kept, s2 = lobes[k].sharpness;
      sum += share;
      for (int c = 0; c < 3; ++c) rows.at(p, at + c, 0, 0) = lobes[k].axis[c];
      rows.at(p, at + 3, 0, 0) = s2, rows.at(p, at + 4, 0, 0) = sum;
      rows.at(p, at + 5, 0, 0) = share * s2 / (2 * M_PI * (1 - std::exp(-2 * s2)));
    }
  }
  return rows;
}

inline Vec3 axis_of(const Tensor& rows, int p, int k) {
  return {rows.at(p, 2 + 6 * k, 0, 0), rows.at(p, 3 + 6 * k, 0, 0), rows.at(p, 4 + 6 * k, 0, 0)};
}

/// Part of row p in the density of a unit vector, camera frame.
inline double guide_density(const Tensor& rows, int p, const Vec3& towards) {
  double sum = 0;
  for (int k = 0; k < static_cast<int>(rows.at(p, 1, 0, 0)); ++k) {
    const Vec3 apart =
        towards - axis_of(rows, p, k);  // half its square is 1 - cos, of axes that were rounded nearly so
    sum += rows.at(p, 7 + 6 * k, 0, 0) * std::exp(-rows.at(p, 5 + 6 * k, 0, 0) * glm::dot(apart, apart) / 2);
  }
  return sum;
}

/// What row p draws for w below its chance, camera frame: w picks the lobe, (u, v) place the direction.
inline Vec3 guided_direction(const Tensor& rows, int p, double u, double v, double w) {
  int k = 0;
  while (k + 1 < static_cast<int>(rows.at(p, 1, 0, 0)) && w >= rows.at(p, 6 + 6 * k, 0, 0)) ++k;
  const double s = rows.at(p, 5 + 6 * k, 0, 0);
  const double cosine = 1 + std::log(1 - u * (1 - std::exp(-2 * s))) / s, across = std::sqrt(1 - cosine * cosine);
  return frame_around(axis_of(rows, p, k))
      .from_local({across * std::cos(2 * M_PI * v), across * std::sin(2 * M_PI * v), cosine});
}

}  // namespace clerestory::light_guide_reference
