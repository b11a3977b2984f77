// Per-pixel environment maps of a view (NNN_envmap.exr): which pixel a tile belongs to, which direction a texel.
//
// Every texel holds radiance along one direction that lies at random inside its cell of the hemisphere, not at the
// cell's centre and not the mean over the cell. A network of incident light is asked along rays, and what a ray meets
// is one pixel of the photograph: means over cells of some 20 degrees would teach it blurred lamps, while centres would
// show it 128 directions of each wall and no others. One direction in each cell, drawn uniformly by solid angle, covers
// the hemisphere, and sums over a tile stay unbiased estimates of integrals (stratified sampling with one sample a
// stratum). The direction is a function of the texel's place alone, so readers know it exactly.
#pragma once
#include "host/math/frames.hpp"

namespace clerestory {

inline constexpr int envmap_tiles = 40;  // along the longer side of the view
inline constexpr int envmap_azimuths = 16, envmap_elevations = 8;

/// The tiles of a view of width x height pixels: 40 along the longer side, as many along the other as make them
/// square, to the nearest whole number. Tile (column, row) is of the pixel that holds its centre.
struct EnvmapLayout {
  int width = 0, height = 0, columns = 0, rows = 0;

  /// Throws usage_error unless both sides are positive.
  static EnvmapLayout of(int width, int height);
  int tiles() const { return columns * rows; }
  int pixel_x(int column) const;
  int pixel_y(int row) const;
  /// Pixels of the file. Texel (azimuth, elevation) of tile (column, row) is its pixel (16 column + azimuth,
  /// 8 row + elevation).
  int file_width() const { return columns * envmap_azimuths; }
  int file_height() const { return rows * envmap_elevations; }
};

/// Unit direction of a texel in the tile's local frame, z > 0. The cell is Li et al.'s: azimuth from
/// (azimuth/16 - .5) 2 pi on, elevation from the normal from (elevation/8) pi/2 on, l = (sin El cos Az, sin El sin Az,
/// cos El). With u, v = (bits + .5) 2^-24 of bits 40-63 and 16-39 of number
/// ((40 row + column) 8 + elevation) 16 + azimuth + 1 of SplitMix64 begun at 0 (Steele, Lea and Flood 2014):
/// cos El is u of the way from the cell's first to its last, azimuth v of the way.
Vec3 envmap_direction(int column, int row, int azimuth, int elevation);
/// The same in camera space; `frame` is hemisphere_frame of the normal at the tile's pixel.
inline Vec3 envmap_direction(const Frame& frame, int column, int row, int azimuth, int elevation) {
  return frame.from_local(envmap_direction(column, row, azimuth, elevation));
}
/// Exact solid angle of a cell, steradians; over a tile they sum to 2 pi.
double envmap_solid_angle(int elevation);

}  // namespace clerestory
