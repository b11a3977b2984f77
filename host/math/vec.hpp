// Names for GLM's vectors. Host geometry is in double; float twins are for data that goes to a device or a file.
#pragma once
#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace clerestory {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using Mat3 = glm::dmat3;
using Mat4 = glm::dmat4;
using Vec2f = glm::vec2;
using Vec3f = glm::vec3;

/// {3, count} floats, component by component: the layout of rays on the device.
inline std::vector<float> planar(std::span<const Vec3> list) {
  std::vector<float> values(3 * list.size());
  for (std::size_t i = 0; i < list.size(); ++i)
    for (int c = 0; c < 3; ++c) values[static_cast<std::size_t>(c) * list.size() + i] = static_cast<float>(list[i][c]);
  return values;
}

}  // namespace clerestory
