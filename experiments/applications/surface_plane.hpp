// How the surface lies that rays meet: by depth, which the layer traces, not by the map of normals, which shades.
#pragma once
#include <optional>

#include "host/math/vec.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// Unit normal, towards the camera, of the plane through the depths around pixel (x, y), camera space. Inverse depth is
/// linear in the ray, 1 / z = v . ray; v is fitted over a fiftieth of the width to each side, with weights by which
/// other surfaces have little say (Cauchy's, at 1 % of depth; first at 10 % of the centre's). Nothing where too few
/// depths are known.
std::optional<Vec3> plane_normal_at(const Scene& scene, int x, int y);

}  // namespace clerestory
