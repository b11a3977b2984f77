#include "tracer/parts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tracer/random.hpp"

namespace clerestory {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// (cos, sin) of k of `sides` steps around: the last step ends in the first one's bits, so that seams close.
glm::vec2 around(int k, int sides) {
  const float angle = 2 * kPi * static_cast<float>(k % sides) / static_cast<float>(sides);
  return {std::cos(angle), std::sin(angle)};
}

/// Value noise in space, in [0, 1].
float noise(const glm::vec3& p, std::uint64_t key) {
  const glm::vec3 cell = glm::floor(p), t = p - cell, s = t * t * (3.f - 2.f * t);
  const auto value = [&](int corner) {
    std::uint64_t hash = Random::mix(key);
    for (int axis = 0; axis < 3; ++axis)
      hash =
          Random::mix(hash ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + (corner >> axis & 1)));
    return static_cast<float>(hash >> 40) * 0x1p-24f;
  };
  const auto along_x = [&](int corner) { return value(corner) + (value(corner + 1) - value(corner)) * s.x; };
  const float near = along_x(0) + (along_x(2) - along_x(0)) * s.y, far = along_x(4) + (along_x(6) - along_x(4)) * s.y;
  return near + (far - near) * s.z;
}

/// Local coordinates with the longest side first: u along the grain.
struct Grain {
  int axis[3] = {0, 1, 2};
  explicit Grain(const glm::vec3& size) {
    std::sort(axis, axis + 3, [&](int a, int b) { return size[a] > size[b]; });
  }
  glm::vec3 operator()(const glm::vec3& p) const { return {p[axis[0]], p[axis[1]], p[axis[2]]}; }
};

/// Triangles of one part.
class Tessellation {
 public:
  Tessellation(const Part& part, World& world) : part_(part), world_(world) {}

  void quad() const {
    const glm::vec3 a = point(0), b = point(3), c = point(6), d = point(9);
    const glm::vec2 uv(number(12), number(13));
    const float u = uv.x + glm::length(b - a), v = uv.y + glm::length(d - a);
    face(vertex(a, {uv.x, uv.y, 0}), vertex(b, {u, uv.y, 0}), vertex(c, {u, v, 0}), vertex(d, {uv.x, v, 0}), false);
  }

  void canvas() const {
    face(vertex(point(0), {-1, -1, 0}), vertex(point(3), {1, -1, 0}), vertex(point(6), {1, 1, 0}),
         vertex(point(9), {-1, 1, 0}), false);
  }

  void box() const {
    const glm::vec3 low = point(0), high = point(3);
    const Grain grain(high - low);
    glm::vec3 p[8];
    for (int i = 0; i < 8; ++i) p[i] = {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    constexpr int faces[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7}, {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
    for (const auto& f : faces) {
      Vertex v[4];
      for (int k = 0; k < 4; ++k) v[k] = vertex(p[f[k]], grain(p[f[k]]) + part_.shift);
      face(v[0], v[1], v[2], v[3], false);
    }
  }

  void cushion() const {
    const glm::vec3 low = point(0), high = point(3);
    const int steps = part_.steps;
    const glm::vec3 middle = (low + high) * 0.5f, half = (high - low) * 0.5f;
    const float r = std::min(number(6), std::min(half.x, std::min(half.y, half.z)));
    const glm::vec3 inner = half - r;
    const Grain grain(high - low);
    // Each face of a cube, finely divided near its edges, is blown up to the sphere and moved out to the inner box.
    const int n = 2 * steps + 1;
    const auto coordinate = [&](int i) {  // -1..1 in `steps` angular steps to the flat part, one step over it
      const int k = i <= steps ? i : n - i;
      const float angle = kPi / 4 * (1 - static_cast<float>(k) / static_cast<float>(steps));
      return (i <= steps ? -1.f : 1.f) * std::tan(angle);
    };
    for (int k = 0; k < 6; ++k) {
      const int axis = k / 2;
      const float side = k % 2 ? 1.f : -1.f;
      const auto at = [&](int i, int j) {
        glm::vec3 q;
        q[axis] = side;
        q[(axis + 1) % 3] = coordinate(i);
        q[(axis + 2) % 3] = coordinate(j);
        const glm::vec3 normal = glm::normalize(q);
        glm::vec3 corner;
        corner[axis] = side * inner[axis];
        corner[(axis + 1) % 3] = (i <= steps ? -1.f : 1.f) * inner[(axis + 1) % 3];
        corner[(axis + 2) % 3] = (j <= steps ? -1.f : 1.f) * inner[(axis + 2) % 3];
        const glm::vec3 p = middle + corner + r * normal;
        return vertex(p, grain(p) + part_.shift, normal);
      };
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          Vertex a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
          if (side < 0) std::swap(b, d);
          face(a, b, c, d, true);
        }
      }
    }
  }

  /// `smooth`: from ring to ring.
  void lathe(bool smooth) const {
    const glm::vec3 base = point(0);
    const int sides = part_.steps;
    std::vector<glm::vec2> profile;
    for (std::size_t i = 3; i + 1 < part_.numbers.size(); i += 2) profile.emplace_back(number(i), number(i + 1));
    const std::vector<glm::vec2> slopes = smooth ? slopes_at(profile) : std::vector<glm::vec2>();
    const auto ring = [&](const glm::vec2& rh, int k, const glm::vec2& slope) {
      const glm::vec2 turn = around(k, sides);
      const glm::vec3 out(turn.x, 0, -turn.y);
      const glm::vec3 p = base + out * rh.x + glm::vec3(0, rh.y, 0);
      const glm::vec3 normal = glm::normalize(out * slope.y - glm::vec3(0, slope.x, 0));
      return vertex(p, p + part_.shift, normal);
    };
    for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
      const glm::vec2 slope = profile[i + 1] - profile[i];
      if (glm::length(slope) <= 0) continue;
      for (int k = 0; k < sides; ++k) {
        const glm::vec2 low = smooth ? slopes[i] : slope, high = smooth ? slopes[i + 1] : slope;
        const Vertex a = ring(profile[i], k, low), b = ring(profile[i], k + 1, low);
        const Vertex c = ring(profile[i + 1], k + 1, high), d = ring(profile[i + 1], k, high);
        if (profile[i].x > 0) add(a, b, c, true);
        if (profile[i + 1].x > 0) add(a, c, d, true);
      }
    }
    if (part_.open) return;
    for (const bool top : {false, true}) {
      const glm::vec2 rh = top ? profile.back() : profile.front();
      if (rh.x <= 0) continue;
      const glm::vec3 middle = base + glm::vec3(0, rh.y, 0);
      const Vertex m = vertex(middle, middle + part_.shift);
      for (int k = 0; k < sides; ++k) {
        const Vertex a = ring(rh, k, {0, 1}), b = ring(rh, k + 1, {0, 1});
        if (top)
          add(m, a, b, false);
        else
          add(m, b, a, false);
      }
    }
  }

  void disc() const {
    const glm::vec3 center = point(0);
    const float radius = number(3);
    const int sides = part_.steps;
    const auto rim = [&](int k) {
      const glm::vec2 turn = around(k, sides);
      const glm::vec3 p = radius * glm::vec3(turn.x, 0, turn.y);
      return vertex(center + p, p);
    };
    const Vertex middle = vertex(center, glm::vec3(0));
    for (int k = 0; k < sides; ++k) add(middle, rim(k), rim(k + 1), false);
  }

  void sphere() const {
    const glm::vec3 center = point(0);
    const float radius = number(3);
    const int steps = part_.steps;
    const auto at = [&](int i, int k) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(steps);
      const float out = i < steps ? std::sin(theta) : 0.f;  // float's pi is not pi: the pole is one point
      const glm::vec2 turn = around(k, 2 * steps);
      const glm::vec3 n(out * turn.x, std::cos(theta), -out * turn.y);
      return vertex(center + radius * n, radius * n + part_.shift, n);
    };
    for (int i = 0; i < steps; ++i) {
      for (int k = 0; k < 2 * steps; ++k) {
        const Vertex a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
        if (i + 1 < steps) add(a, b, c, true);
        if (i > 0) add(a, c, d, true);
      }
    }
  }

  void blob() const {
    const glm::vec3 center = point(0), radii = point(3);
    const float depth = number(6), waves = number(7);
    const auto key = static_cast<std::uint64_t>(number(8));
    const auto place = [&](const glm::vec3& n) { return radii * n * (1 - depth * noise(waves * n, key)); };
    const int steps = part_.steps;
    const auto at = [&](int i, int k) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(steps);
      const float out = i > 0 && i < steps ? std::sin(theta) : 0.f;  // each pole is one point
      const glm::vec2 turn = around(k, 2 * steps);
      const glm::vec3 n(out * turn.x, std::cos(theta), -out * turn.y);
      const glm::vec3 side =
          glm::normalize(glm::cross(std::abs(n.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0), n));
      const glm::vec3 up = glm::cross(n, side);
      constexpr float step = 0.02f;  // a hundredth of a bump
      const auto slope = [&](const glm::vec3& d) {
        return place(glm::normalize(n + step * d)) - place(glm::normalize(n - step * d));
      };
      const glm::vec3 p = place(n);
      return vertex(center + p, p + part_.shift, glm::normalize(glm::cross(slope(side), slope(up))));
    };
    for (int i = 0; i < steps; ++i)
      for (int k = 0; k < 2 * steps; ++k) {
        const Vertex a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
        if (i + 1 < steps) add(a, b, c, true);
        if (i > 0) add(a, c, d, true);
      }
  }

  void cloth() const {
    const glm::vec3 foot = point(0);
    const float width = number(3), depth = number(4), height = number(5);
    const auto key = static_cast<std::uint64_t>(number(6));
    // Its borders are ragged, and lie on what it lies on.
    const auto place = [&](float s, float t) {
      const float rise = (1 - s * s * s * s) * (1 - t * t * t * t);
      const float hills = noise({1.3f * s, 1.3f * t, 0.5f}, key), fold = noise({3.f * s, 3.f * t, 5.5f}, key);
      const float pleat = noise({5.f * s + 2 * hills, 5.f * t, 9.5f}, key);
      const auto ridge = [](float n) { return 4 * n * (1 - n); };
      const float up = 0.55f * hills + 0.3f * ridge(fold) + 0.15f * ridge(pleat);
      const glm::vec2 drawn(0.75f + 0.25f * noise({2.f * t, 1.5f, 0}, key),
                            0.75f + 0.25f * noise({2.f * s, 3.5f, 0}, key));
      return foot + glm::vec3(0.5f * width * s * drawn.x, height * (0.02f + rise * up), 0.5f * depth * t * drawn.y);
    };
    const int steps = part_.steps;
    const auto share = [&](int i) { return 2 * static_cast<float>(i) / static_cast<float>(steps) - 1; };
    const auto at = [&](int i, int k) {
      const float s = share(i), t = share(k), step = 0.5f / static_cast<float>(steps);
      const glm::vec3 along = place(s + step, t) - place(s - step, t), across = place(s, t + step) - place(s, t - step);
      const glm::vec3 uvw(0.5f * width * s, 0.5f * depth * t, 0);
      return vertex(place(s, t), uvw + part_.shift, glm::normalize(glm::cross(across, along)));
    };
    for (int i = 0; i < steps; ++i)
      for (int k = 0; k < steps; ++k) face(at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k), true);
  }

  void mesh(const Mesh& mesh) const {
    const glm::vec3 base = point(0);
    const float height = number(3);
    const Extent b = bounds(mesh);
    const glm::vec3 low(b.low[0], b.low[1], b.low[2]), high(b.high[0], b.high[1], b.high[2]);
    const float scale = height / std::max(high.y - low.y, 1e-6f);
    const glm::vec3 foot((low.x + high.x) / 2, low.y, (low.z + high.z) / 2);
    const auto corner = [&](std::uint32_t i) {
      const auto& p = mesh.positions[i];
      const auto& n = mesh.normals[i];
      const glm::vec3 local = (glm::vec3(p[0], p[1], p[2]) - foot) * scale;
      return vertex(base + local, local + part_.shift, {n[0], n[1], n[2]});
    };
    for (const auto& t : mesh.indices) add(corner(t[0]), corner(t[1]), corner(t[2]), true);
  }

  void curtain() const {
    const glm::vec3 low = point(0), shift = part_.shift;
    const float width = number(3), height = number(4), fold = number(5);
    const int folds = part_.steps;
    const int steps = folds * 8;
    float along = 0;
    const auto place = [&](int i) {
      const float s = static_cast<float>(i) / static_cast<float>(steps);
      return glm::vec3(low.x + width * s, low.y, low.z + fold * std::sin(2 * kPi * s * static_cast<float>(folds)));
    };
    const auto normal = [&](int i) {
      const glm::vec3 d = place(i + 1) - place(i - 1);
      return glm::normalize(glm::vec3(-d.z, 0, d.x));
    };
    for (int i = 0; i < steps; ++i) {
      const glm::vec3 p = place(i), q = place(i + 1), up(0, height, 0);
      const float step = glm::length(q - p);
      const Vertex a = vertex(p, shift + glm::vec3(along, 0, 0), normal(i));
      const Vertex b = vertex(q, shift + glm::vec3(along + step, 0, 0), normal(i + 1));
      const Vertex c = vertex(q + up, shift + glm::vec3(along + step, height, 0), normal(i + 1));
      const Vertex d = vertex(p + up, shift + glm::vec3(along, height, 0), normal(i));
      face(a, b, c, d, true);
      along += step;
    }
  }

  void tube() const {
    const float radius = number(0);
    const std::size_t count = (part_.numbers.size() - 1) / 3;
    const auto axis = [&](std::size_t i) { return point(1 + 3 * i); };
    glm::vec3 side(0);
    float along = 0;
    std::vector<Vertex> last, ring;
    for (std::size_t i = 0; i < count; ++i) {
      const glm::vec3 before =
          glm::normalize(axis(std::max<std::size_t>(i, 1)) - axis(std::max<std::size_t>(i, 1) - 1));
      const glm::vec3 after = i + 1 < count ? glm::normalize(axis(i + 1) - axis(i)) : before;
      const glm::vec3 t = glm::normalize(before + after);
      // The ring is carried along the axis and not turned about it.
      if (i == 0) side = std::abs(t.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
      side = glm::normalize(side - t * glm::dot(side, t));
      if (i > 0) along += glm::length(axis(i) - axis(i - 1));
      ring.clear();
      for (int k = 0; k <= part_.steps; ++k) {
        const glm::vec2 turn = around(k, part_.steps);
        const glm::vec3 out = side * turn.x + glm::cross(t, side) * turn.y;
        const float arc = 2 * kPi * radius * static_cast<float>(k) / static_cast<float>(part_.steps);
        ring.push_back(vertex(axis(i) + radius * out, glm::vec3(along, arc, 0) + part_.shift, out));
      }
      for (std::size_t k = 0; i > 0 && k + 1 < ring.size(); ++k) face(last[k], last[k + 1], ring[k + 1], ring[k], true);
      if (i == 0 || i + 1 == count) cap(axis(i), ring, i > 0);
      last = ring;
    }
  }

 private:
  /// Directions of a profile at its rings: between those of its neighbours, around where it ends where it begins.
  static std::vector<glm::vec2> slopes_at(const std::vector<glm::vec2>& profile) {
    const std::size_t last = profile.size() - 1;
    const bool closed = profile.front() == profile.back();
    const auto step = [&](std::size_t i) {
      const glm::vec2 d = profile[i + 1] - profile[i];
      return glm::length(d) > 0 ? glm::normalize(d) : glm::vec2(0);
    };
    std::vector<glm::vec2> slopes;
    for (std::size_t i = 0; i <= last; ++i) {
      const glm::vec2 before = i > 0 ? step(i - 1) : closed ? step(last - 1) : step(0);
      const glm::vec2 after = i < last ? step(i) : closed ? step(0) : step(last - 1);
      slopes.push_back(glm::length(before + after) > 1e-3f ? before + after : after);
    }
    return slopes;
  }
  /// The flat end of a tube.
  void cap(const glm::vec3& middle, std::vector<Vertex> ring, bool far) const {
    for (std::size_t k = 0; k + 1 < ring.size(); ++k)
      add(vertex(middle, part_.shift), ring[far ? k : k + 1], ring[far ? k + 1 : k], false);
  }
  float number(std::size_t i) const { return part_.numbers[i]; }
  glm::vec3 point(std::size_t i) const { return {number(i), number(i + 1), number(i + 2)}; }

  Vertex vertex(const glm::vec3& p, const glm::vec3& uvw, const glm::vec3& normal = glm::vec3(0)) const {
    return {glm::vec3(part_.to_room * glm::vec4(p, 1)), uvw, glm::mat3(part_.to_room) * normal};
  }
  void add(const Vertex& a, const Vertex& b, const Vertex& c, bool smooth) const {
    Triangle t;
    t.v[0] = a, t.v[1] = b, t.v[2] = c;
    t.material = part_.material, t.emitter = part_.emitter, t.smooth = smooth;
    world_.triangles.push_back(t);
  }
  void face(const Vertex& a, const Vertex& b, const Vertex& c, const Vertex& d, bool smooth) const {
    add(a, b, c, smooth);
    add(a, c, d, smooth);
  }

  const Part& part_;
  World& world_;
};

}  // namespace

void add_part(World& world, const Part& part, const Mesh* mesh) {
  const Tessellation t(part, world);
  switch (part.kind) {
    case PartKind::Quad:
      return t.quad();
    case PartKind::Canvas:
      return t.canvas();
    case PartKind::Box:
      return t.box();
    case PartKind::Cushion:
      return t.cushion();
    case PartKind::Lathe:
      return t.lathe(false);
    case PartKind::Disc:
      return t.disc();
    case PartKind::Sphere:
      return t.sphere();
    case PartKind::Mesh:
      return t.mesh(*mesh);
    case PartKind::Curtain:
      return t.curtain();
    case PartKind::Tube:
      return t.tube();
    case PartKind::Turned:
      return t.lathe(true);
    case PartKind::Blob:
      return t.blob();
    case PartKind::Cloth:
      return t.cloth();
  }
}

}  // namespace clerestory
