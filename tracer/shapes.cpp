#include "tracer/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace clerestory {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

glm::vec3 random_shift(Random& random) {
  return {random.between(-50, 50), random.between(-50, 50), random.between(-50, 50)};
}

/// (cos, sin) of k of `sides` steps around: the last step ends in the first one's bits, so that seams close.
glm::vec2 around(int k, int sides) {
  const float angle = 2 * kPi * static_cast<float>(k % sides) / static_cast<float>(sides);
  return {std::cos(angle), std::sin(angle)};
}

/// Local coordinates with the longest side first: u along the grain.
struct Grain {
  int axis[3] = {0, 1, 2};
  explicit Grain(const glm::vec3& size) {
    std::sort(axis, axis + 3, [&](int a, int b) { return size[a] > size[b]; });
  }
  glm::vec3 operator()(const glm::vec3& p) const { return {p[axis[0]], p[axis[1]], p[axis[2]]}; }
};

}  // namespace

Shapes::Shapes(World& scene, const glm::mat4& to_room, Random random)
    : scene_(&scene), to_room_(to_room), random_(random) {}

Shapes Shapes::at(const glm::mat4& local) { return Shapes(*scene_, to_room_ * local, random_.fork(random_.bits())); }

Shapes Shapes::at(const glm::vec3& offset, float turn_about_y) {
  return at(glm::rotate(glm::translate(glm::mat4(1), offset), turn_about_y, glm::vec3(0, 1, 0)));
}

int Shapes::material(const Material& material) {
  scene_->materials.push_back(material);
  return static_cast<int>(scene_->materials.size()) - 1;
}

int Shapes::emitter(const Emitter& emitter) {
  scene_->emitters.push_back(emitter);
  return static_cast<int>(scene_->emitters.size()) - 1;
}

Vertex Shapes::vertex(const glm::vec3& p, const glm::vec3& uvw, const glm::vec3& normal) const {
  return {glm::vec3(to_room_ * glm::vec4(p, 1)), uvw, glm::mat3(to_room_) * normal};
}

void Shapes::add(const Vertex& a, const Vertex& b, const Vertex& c, int material, int emitter, bool smooth) {
  Triangle t;
  t.v[0] = a, t.v[1] = b, t.v[2] = c;
  t.material = material, t.emitter = emitter, t.smooth = smooth;
  scene_->triangles.push_back(t);
}

void Shapes::quad(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material,
                  int emitter, const glm::vec2& uv) {
  const float u = uv.x + glm::length(b - a), v = uv.y + glm::length(d - a);
  const Vertex va = vertex(a, {uv.x, uv.y, 0}), vb = vertex(b, {u, uv.y, 0});
  const Vertex vc = vertex(c, {u, v, 0}), vd = vertex(d, {uv.x, v, 0});
  add(va, vb, vc, material, emitter, false);
  add(va, vc, vd, material, emitter, false);
}

void Shapes::canvas(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, int material) {
  const Vertex va = vertex(a, {-1, -1, 0}), vb = vertex(b, {1, -1, 0});
  const Vertex vc = vertex(c, {1, 1, 0}), vd = vertex(d, {-1, 1, 0});
  add(va, vb, vc, material, -1, false);
  add(va, vc, vd, material, -1, false);
}

void Shapes::box(const glm::vec3& low, const glm::vec3& high, int material) {
  const Grain grain(high - low);
  const glm::vec3 shift = random_shift(random_);
  glm::vec3 p[8];
  for (int i = 0; i < 8; ++i) p[i] = {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
  constexpr int faces[6][4] = {{4, 5, 7, 6}, {1, 0, 2, 3}, {5, 1, 3, 7}, {0, 4, 6, 2}, {6, 7, 3, 2}, {0, 1, 5, 4}};
  for (const auto& f : faces) {
    Vertex v[4];
    for (int k = 0; k < 4; ++k) v[k] = vertex(p[f[k]], grain(p[f[k]]) + shift);
    add(v[0], v[1], v[2], material, -1, false);
    add(v[0], v[2], v[3], material, -1, false);
  }
}

void Shapes::block(const glm::vec3& base, const glm::vec3& size, int material) {
  const glm::vec3 half(size.x / 2, 0, size.z / 2);
  box(base - half, base + half + glm::vec3(0, size.y, 0), material);
}

void Shapes::cushion(const glm::vec3& low, const glm::vec3& high, float radius, int material, int steps) {
  const glm::vec3 middle = (low + high) * 0.5f, half = (high - low) * 0.5f;
  const float r = std::min(radius, std::min(half.x, std::min(half.y, half.z)));
  const glm::vec3 inner = half - r, shift = random_shift(random_);
  const Grain grain(high - low);
  // Each face of a cube, finely divided near its edges, is blown up to the sphere and moved out to the inner box.
  const int n = 2 * steps + 1;
  const auto coordinate = [&](int i) {  // -1..1 in `steps` angular steps to the flat part, one step over it
    const int k = i <= steps ? i : n - i;
    const float angle = kPi / 4 * (1 - static_cast<float>(k) / static_cast<float>(steps));
    return (i <= steps ? -1.f : 1.f) * std::tan(angle);
  };
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const float side = face % 2 ? 1.f : -1.f;
    const auto point = [&](int i, int j) {
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
      return vertex(p, grain(p) + shift, normal);
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        Vertex a = point(i, j), b = point(i + 1, j), c = point(i + 1, j + 1), d = point(i, j + 1);
        if (side < 0) std::swap(b, d);
        add(a, b, c, material, -1, true);
        add(a, c, d, material, -1, true);
      }
    }
  }
}

void Shapes::lathe(const glm::vec3& base, const std::vector<glm::vec2>& profile, int material, int sides, int emitter,
                   bool open) {
  const glm::vec3 shift = random_shift(random_);
  const auto ring = [&](const glm::vec2& rh, int k, const glm::vec2& slope) {
    const glm::vec2 turn = around(k, sides);
    const glm::vec3 out(turn.x, 0, -turn.y);
    const glm::vec3 p = base + out * rh.x + glm::vec3(0, rh.y, 0);
    const glm::vec3 normal = glm::normalize(out * slope.y - glm::vec3(0, slope.x, 0));
    return vertex(p, p + shift, normal);
  };
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const glm::vec2 slope = profile[i + 1] - profile[i];
    if (glm::length(slope) <= 0) continue;
    for (int k = 0; k < sides; ++k) {
      const Vertex a = ring(profile[i], k, slope), b = ring(profile[i], k + 1, slope);
      const Vertex c = ring(profile[i + 1], k + 1, slope), d = ring(profile[i + 1], k, slope);
      if (profile[i].x > 0) add(a, b, c, material, emitter, true);
      if (profile[i + 1].x > 0) add(a, c, d, material, emitter, true);
    }
  }
  if (open) return;
  for (const bool top : {false, true}) {
    const glm::vec2 rh = top ? profile.back() : profile.front();
    if (rh.x <= 0) continue;
    const glm::vec3 middle = base + glm::vec3(0, rh.y, 0);
    const Vertex m = vertex(middle, middle + shift);
    for (int k = 0; k < sides; ++k) {
      const Vertex a = ring(rh, k, {0, 1}), b = ring(rh, k + 1, {0, 1});
      if (top)
        add(m, a, b, material, emitter, false);
      else
        add(m, b, a, material, emitter, false);
    }
  }
}

void Shapes::cylinder(const glm::vec3& base, float radius, float height, int material, int sides) {
  lathe(base, {{radius, 0}, {radius, height}}, material, sides);
}

void Shapes::disc(const glm::vec3& center, float radius, int material, int sides, int emitter) {
  const auto rim = [&](int k) {
    const glm::vec2 turn = around(k, sides);
    const glm::vec3 p = radius * glm::vec3(turn.x, 0, turn.y);
    return vertex(center + p, p);
  };
  const Vertex middle = vertex(center, glm::vec3(0));
  for (int k = 0; k < sides; ++k) add(middle, rim(k), rim(k + 1), material, emitter, false);
}

void Shapes::rod(const glm::vec3& from, const glm::vec3& to, float thickness, int material) {
  const glm::vec3 along = to - from;
  const float length = glm::length(along);
  const glm::vec3 z = along / length;
  const glm::vec3 x = glm::normalize(glm::cross(std::abs(z.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0), z));
  glm::mat4 local(1);
  local[0] = glm::vec4(x, 0);
  local[1] = glm::vec4(glm::cross(z, x), 0);
  local[2] = glm::vec4(z, 0);
  local[3] = glm::vec4(from, 1);
  const float h = thickness / 2;
  at(local).box({-h, -h, 0}, {h, h, length}, material);
}

void Shapes::sphere(const glm::vec3& center, float radius, int material, int steps, int emitter) {
  const glm::vec3 shift = random_shift(random_);
  const auto point = [&](int i, int k) {
    const float theta = kPi * static_cast<float>(i) / static_cast<float>(steps);
    const float out = i < steps ? std::sin(theta) : 0.f;  // float's pi is not pi: the pole is one point
    const glm::vec2 turn = around(k, 2 * steps);
    const glm::vec3 n(out * turn.x, std::cos(theta), -out * turn.y);
    return vertex(center + radius * n, radius * n + shift, n);
  };
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < 2 * steps; ++k) {
      const Vertex a = point(i, k), b = point(i + 1, k), c = point(i + 1, k + 1), d = point(i, k + 1);
      if (i + 1 < steps) add(a, b, c, material, emitter, true);
      if (i > 0) add(a, c, d, material, emitter, true);
    }
  }
}

void Shapes::mesh(const Mesh& mesh, const glm::vec3& base, float height, int material) {
  const Extent b = bounds(mesh);
  const glm::vec3 low(b.low[0], b.low[1], b.low[2]), high(b.high[0], b.high[1], b.high[2]);
  const float scale = height / std::max(high.y - low.y, 1e-6f);
  const glm::vec3 foot((low.x + high.x) / 2, low.y, (low.z + high.z) / 2);
  const glm::vec3 shift = random_shift(random_);
  const auto corner = [&](std::uint32_t i) {
    const auto& p = mesh.positions[i];
    const auto& n = mesh.normals[i];
    const glm::vec3 local = (glm::vec3(p[0], p[1], p[2]) - foot) * scale;
    return vertex(base + local, local + shift, {n[0], n[1], n[2]});
  };
  for (const auto& t : mesh.indices) add(corner(t[0]), corner(t[1]), corner(t[2]), material, -1, true);
}

void Shapes::curtain(const glm::vec3& low, float width, float height, float fold, int folds, int material) {
  const glm::vec3 shift = random_shift(random_);
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
    add(a, b, c, material, -1, true);
    add(a, c, d, material, -1, true);
    along += step;
  }
}

}  // namespace clerestory
