// Equirectangular panoramas: centre column looks along -z, the right quarter along +x, the top row along +y.
#pragma once
#include "host/math/vec.hpp"

namespace clerestory {

/// (u, v) in [0, 1] x [0, 1] of a direction of any length but zero; u grows to the right, v downwards. The pixel is
/// (floor(u columns), floor(v rows)), clamped. At the poles u is 0.5.
Vec2 panorama_position(const Vec3& direction);
/// Unit direction of (u, v); the inverse of the above.
Vec3 panorama_direction(const Vec2& uv);
/// Direction of the centre of pixel (column, row).
Vec3 panorama_direction(int column, int row, int columns, int rows);
/// Exact solid angle of a pixel of `row`, steradians; over all pixels it sums to 4 pi.
double panorama_solid_angle(int row, int columns, int rows);

/// Direction i of `count` spread evenly over the sphere, from +y to -y (Fibonacci lattice).
Vec3 lattice_direction(int i, int count);

}  // namespace clerestory
