// A closed box whose six walls emit six colours, and which of them a ray meets, by plain arithmetic.
#pragma once
#include <array>
#include <limits>

#include "tests/tracer/scenes.hpp"

namespace clerestory {

inline const glm::dvec3 kBoxLow{-1.5, 0, -2}, kBoxHigh{2, 2.4, 1.8};

/// Light of the wall that faces along `axis`, at the box's low or high end.
inline glm::vec3 color_of_wall(int axis, bool high) {
  glm::vec3 color(0.25f);
  color[axis] = high ? 4.f : 2.f;
  return color;
}

inline World colored_box() {
  World scene;
  Shapes shapes(scene, glm::mat4(1), Random(1));
  const int wall = shapes.material(plain(glm::vec3(0.5f), 1));
  const glm::vec3 l(kBoxLow), h(kBoxHigh);
  const auto emitter = [&](int axis, bool high) { return shapes.emitter({color_of_wall(axis, high), false}); };
  // Corners counter-clockwise seen from inside.
  shapes.quad({l.x, l.y, h.z}, {l.x, l.y, l.z}, {l.x, h.y, l.z}, {l.x, h.y, h.z}, wall, emitter(0, false));
  shapes.quad({h.x, l.y, l.z}, {h.x, l.y, h.z}, {h.x, h.y, h.z}, {h.x, h.y, l.z}, wall, emitter(0, true));
  shapes.quad({l.x, l.y, h.z}, {h.x, l.y, h.z}, {h.x, l.y, l.z}, {l.x, l.y, l.z}, wall, emitter(1, false));
  shapes.quad({l.x, h.y, l.z}, {h.x, h.y, l.z}, {h.x, h.y, h.z}, {l.x, h.y, h.z}, wall, emitter(1, true));
  shapes.quad({l.x, l.y, l.z}, {h.x, l.y, l.z}, {h.x, h.y, l.z}, {l.x, h.y, l.z}, wall, emitter(2, false));
  shapes.quad({h.x, l.y, h.z}, {l.x, l.y, h.z}, {l.x, h.y, h.z}, {h.x, h.y, h.z}, wall, emitter(2, true));
  return scene;
}

struct BoxHit {
  glm::vec3 radiance{0};
  double margin = 0;  // to the box's nearest edge, metres
};

/// What a ray from inside the box, or from one of its walls, meets; world space.
inline BoxHit hit_in_colored_box(const glm::dvec3& point, const glm::dvec3& direction) {
  double nearest = std::numeric_limits<double>::infinity();
  int axis = 0;
  for (int c = 0; c < 3; ++c) {
    const double t = ((direction[c] > 0 ? kBoxHigh[c] : kBoxLow[c]) - point[c]) / direction[c];
    if (direction[c] != 0 && t < nearest) nearest = t, axis = c;
  }
  const glm::dvec3 at = point + nearest * direction;
  BoxHit hit{color_of_wall(axis, direction[axis] > 0), std::numeric_limits<double>::infinity()};
  for (int c = 0; c < 3; ++c) {
    if (c != axis) hit.margin = std::min({hit.margin, at[c] - kBoxLow[c], kBoxHigh[c] - at[c]});
  }
  return hit;
}

}  // namespace clerestory
