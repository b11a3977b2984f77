// Names for GLM's vectors. Host geometry is in double; float twins are for data that goes to a device or a file.
#pragma once
#include <glm/glm.hpp>

namespace clerestory {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using Mat3 = glm::dmat3;
using Mat4 = glm::dmat4;
using Vec2f = glm::vec2;
using Vec3f = glm::vec3;

}  // namespace clerestory
