// The light of a generated view: environment maps at surface points (NNN_envmap.exr) and panoramas at points in free
// air (NNN_probe_KK.exr with NNN_probes.json). All radiance is scaled by the view's exposure, like its picture; lamps
// and windows that a ray meets are in it.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "host/io/image.hpp"
#include "host/math/envmap.hpp"
#include "host/math/vec.hpp"

namespace clerestory {

inline constexpr int probe_width = 128, probe_height = 64;

/// Radiance that arrives at the surface points of a view from directions above them, one tile for each of about 40 x 30
/// pixels. A tile whose pixel has no surface (depth 0) is all zeros and means nothing: look the depth up.
/// Elsewhere, too, a few texels in a thousand are 0: on smooth meshes some directions above the shading normal's plane
/// lie below the triangle's, where the tracer's paths meet the triangle itself and end. On a smooth lamp they meet what
/// it sends out, and such a texel has the lamp's own radiance.
struct Envmaps {
  EnvmapLayout layout;
  Image radiance;  // 3 channels, layout.file_width() x layout.file_height()

  /// Along envmap_direction(hemisphere_frame(normal of the pixel), column, row, azimuth, elevation).
  std::array<float, 3> at(int column, int row, int azimuth, int elevation) const;
};

/// Radiance that arrives at one point. Texel (x, y): along panorama_direction(x, y, 128, 64) in camera axes.
struct Probe {
  Vec3 center{0};        // camera space, metres
  double distance = 0;   // to the nearest surface, metres
  bool visible = false;  // inside the picture and before what its pixel shows
  Image radiance;        // 3 channels, 128 x 64
};

/// Environment maps of a view of width x height pixels, NNN_envmap.exr; `generate --no-light` writes none. Throws
/// usage_error naming the file, pixel and value: a missing file, a size that is not the layout's, values that are not
/// finite or negative.
Envmaps read_envmaps(const std::filesystem::path& room, const std::string& id, int width, int height);

/// The probes of a view, in the file's order; a view with no room for one has none. Throws usage_error naming the file:
/// a missing one, a list that is none, keys missing or of another kind, a distance that is not positive, a panorama of
/// another size, values that are not finite or negative.
std::vector<Probe> read_probes(const std::filesystem::path& room, const std::string& id);

/// Write the same files, in half where every value fits. Throw Error on wrong sizes and on values that are not finite
/// or negative.
void write_envmaps(const std::filesystem::path& room, const std::string& id, const Envmaps& envmaps);
void write_probes(const std::filesystem::path& room, const std::string& id, const std::vector<Probe>& probes);

}  // namespace clerestory
