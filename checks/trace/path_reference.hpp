// A path tracer in plain double arithmetic: every triangle in turn, directions by the cosine, light by points spread
// evenly over all that emits and by nothing else, so that no weights join two ways. Slow, and independent of kernels.
#pragma once
#include <optional>

#include "checks/trace/reference.hpp"
#include "host/math/panorama.hpp"
#include "tracer/random.hpp"
#include "tracer/scene.hpp"

namespace clerestory::reference {

/// What the panorama shows along unit d, bilinear between centres of pixels; turned, it is looked up that far to the
/// right.
inline V sky(const World& world, const V& d) {
  const Panorama& p = world.panorama;
  const double a = static_cast<double>(world.panorama_turn);
  const Vec2 uv =
      panorama_position({std::cos(a) * d.x - std::sin(a) * d.z, d.y, std::sin(a) * d.x + std::cos(a) * d.z});
  const double x = uv.x * p.width - 0.5, y = uv.y * p.height - 0.5;
  V sum(0);
  for (int k = 0; k < 4; ++k) {
    const double cx = std::floor(x) + k % 2, cy = std::floor(y) + k / 2;
    const int column = (static_cast<int>(cx) + p.width) % p.width,
              row = std::clamp(static_cast<int>(cy), 0, p.height - 1);
    const float* rgb = &p.rgb[3 * static_cast<std::size_t>(row * p.width + column)];
    sum += (1 - std::abs(x - cx)) * (1 - std::abs(y - cy)) * V(rgb[0], rgb[1], rgb[2]);
  }
  return sum;
}

/// Untextured worlds: a material is its first set of numbers.
class PathTracer {
 public:
  /// At o + t d, with barycentric u, v of the second and third corner of world.triangles[facet].
  struct Hit {
    double t, u, v;
    std::size_t facet;
  };

  explicit PathTracer(const World& world) : world_(world) {
    for (const Triangle& t : world.triangles) {
      Facet f;
      f.corner = V(t.v[0].position), f.e1 = V(t.v[1].position) - f.corner, f.e2 = V(t.v[2].position) - f.corner;
      const V cross = glm::cross(f.e1, f.e2);
      f.area = glm::length(cross) / 2, f.normal = glm::normalize(cross), f.of = &t;
      if (t.emitter >= 0) emitting_.push_back(facets_.size()), area_ += f.area;
      facets_.push_back(f);
    }
  }

  /// The first with 0 < t < t_max.
  std::optional<Hit> nearest(const V& o, const V& d, double t_max) const {
    std::optional<Hit> hit;
    for (std::size_t i = 0; i < facets_.size(); ++i) {
      const Facet& f = facets_[i];
      const V p = glm::cross(d, f.e2), s = o - f.corner, q = glm::cross(s, f.e1);
      const double inverse = 1 / glm::dot(f.e1, p), u = glm::dot(s, p) * inverse, v = glm::dot(d, q) * inverse,
                   t = glm::dot(f.e2, q) * inverse;
      if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < t_max) t_max = t, hit = Hit{t, u, v, i};
    }
    return hit;
  }

  /// What d meets there: the side that it sees, the shading normal on that side, and the radiance that it gives off
  /// towards o.
  struct Surface {
    V face, normal;
    const Material* material;
    int emitter;  // -1: none, and seen from behind
    V emission;
  };
  Surface surface(const Hit& hit, const V& d) const {
    const Facet& facet = facets_[hit.facet];
    const bool front = glm::dot(facet.normal, d) < 0;
    Surface s{facet.normal, facet.normal, &world_.materials[static_cast<std::size_t>(facet.of->material)],
              front ? facet.of->emitter : -1, front ? emitted(facet, d) : V(0)};
    if (facet.of->smooth) {
      const Vertex* v = facet.of->v;
      s.normal = glm::normalize((1 - hit.u - hit.v) * V(v[0].normal) + hit.u * V(v[1].normal) + hit.v * V(v[2].normal));
    }
    if (!front) s.face = -s.face, s.normal = -s.normal;
    return s;
  }

  /// One path's estimate of the radiance that arrives at o from unit d, with at most `depth` scatterings.
  V radiance(V o, V d, int depth, Random& random) const {
    V sum(0), throughput(1);
    for (int vertex = 0;; ++vertex) {
      const std::optional<Hit> hit = nearest(o, d, 1e30);
      if (!hit) return sum;
      const auto [face, normal, material, emitter, emission] = surface(*hit, d);
      if (vertex == 0) sum += emission;
      if (vertex == depth) return sum;
      const V across = glm::normalize(glm::cross(std::abs(normal.x) < 0.5 ? V(1, 0, 0) : V(0, 1, 0), normal));
      const glm::dmat3 frame(across, glm::cross(normal, across), normal);
      const V wo = glm::transpose(frame) * -d, start = o + hit->t * d + 1e-4 * face;
      if (wo.z <= 0) return sum;
      const Brdf brdf{V(material->color_a), static_cast<double>(material->roughness_a),
                      static_cast<double>(material->metallic_a)};
      sum += throughput * direct(brdf, frame, wo, start, random);

      const double u = unit(random), phi = 2 * std::numbers::pi * unit(random);
      const V wi(std::sqrt(u) * std::cos(phi), std::sqrt(u) * std::sin(phi), std::sqrt(1 - u));
      throughput *= brdf(wi, wo) * std::numbers::pi;  // f cos over cos / pi
      o = start, d = frame * wi;
    }
  }

 private:
  struct Facet {
    V corner, e1, e2, normal;
    double area = 0;
    const Triangle* of = nullptr;
  };

  static double unit(Random& random) { return static_cast<double>(random.bits() >> 11) * 0x1p-53; }

  V emitted(const Facet& facet, const V& d) const {
    if (facet.of->emitter < 0) return V(0);
    const Emitter& e = world_.emitters[static_cast<std::size_t>(facet.of->emitter)];
    return V(e.radiance) * (e.panorama ? sky(world_, d) : V(1));
  }
  V direct(const Brdf& brdf, const glm::dmat3& frame, const V& wo, const V& start, Random& random) const {
    double place = unit(random) * area_;
    std::size_t k = 0;
    while (k + 1 < emitting_.size() && place >= facets_[emitting_[k]].area) place -= facets_[emitting_[k++]].area;
    const Facet& light = facets_[emitting_[k]];
    const double root = std::sqrt(unit(random)), v = root * unit(random);
    const V to = light.corner + (root - v) * light.e1 + v * light.e2 - start;
    const double d2 = glm::dot(to, to);
    const V wi = to / std::sqrt(d2), local = glm::transpose(frame) * wi;
    const double facing = -glm::dot(wi, light.normal);
    if (facing <= 0 || local.z <= 0 || nearest(start, to, 1 - 1e-6)) return V(0);
    return brdf(local, wo) * emitted(light, wi) * (local.z * facing / d2 * area_);
  }

  const World& world_;
  std::vector<Facet> facets_;
  std::vector<std::size_t> emitting_;
  double area_ = 0;
};

}  // namespace clerestory::reference
