// Local frames on surfaces and the rasters of directions that files use.
#pragma once
#include "host/math/vec.hpp"

namespace clerestory {

struct Frame {
  Vec3 x, y, z;
  Vec3 to_local(const Vec3& v) const { return {glm::dot(v, x), glm::dot(v, y), glm::dot(v, z)}; }
  Vec3 from_local(const Vec3& v) const { return v.x * x + v.y * y + v.z * z; }
};

/// Right-handed orthonormal frame around unit `n` (Duff et al. 2017, JCGT 6(1), listing 3): no branch but a sign.
Frame frame_around(const Vec3& n);

/// The frame of the environment maps of Li et al. 2020: z = n, y = norm(up - (up.n) n), x = -norm(y cross n), with
/// up = (0,1,0), or (0,0,1) where |up.n| > 0.999. Note that it is left-handed. `n` is unit length, in camera space.
Frame hemisphere_frame(const Vec3& n);

/// Centre of cell (row, column) of an elevation x azimuth raster over the upper hemisphere, in the local frame:
/// azimuth ((column + .5)/columns - .5) 2 pi, elevation from the normal ((row + .5)/rows) pi/2,
/// l = (sin El cos Az, sin El sin Az, cos El). The files use 8 rows x 16 columns.
Vec3 hemisphere_direction(int row, int column, int rows = 8, int columns = 16);
/// Weight of the same cell as Li et al. have it: sin El pi^2 / (rows columns), steradians.
double hemisphere_weight(int row, int rows = 8, int columns = 16);

}  // namespace clerestory
