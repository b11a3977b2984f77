// `clerestory light`: the light that arrives at one point of a run, from everywhere, as a panorama.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/applications/light_choice.hpp"
#include "host/io/resize.hpp"
#include "nets/render_scene.hpp"
#include "nets/scene_radiance.hpp"

namespace clerestory {

/// Exactly one place.
struct LightOptions {
  std::filesystem::path run, out;                      // out empty: RUN/light.exr; a PNG goes beside it
  std::filesystem::path json;                          // that the caller will write, and so not this; may be empty
  bool force = false;                                  // replace files of others
  std::optional<std::array<double, 3>> at_point;       // camera metres
  std::optional<std::array<double, 2>> at;             // pixel: just above its surface
  Size size{256, 128};                                 // of the panorama
  RenderSettings render;                               // light, ssrt, delta
  LightChoice lit_by{.weights = {}, .lamps = "none"};  // along single rays nets alone are closer to the truth
  std::string device, gemm = "auto";
  std::vector<std::string> command;
};

/// Where a panorama is asked for, and what is to be said about that place.
struct AskedPlace {
  Vec3 point{0};
  int skip = -1;     // pixel whose surface it belongs to
  std::string note;  // empty: nothing remarkable
};

/// The room of the out-of-view light is a sphere of this many scene scales around the camera.
inline constexpr double kRoomRadius = 3;
/// How far above its surface the point of a pixel lies, metres.
inline constexpr double kAboveSurface = 0.01;

/// Throws usage_error: not exactly one place, a number that is not finite, a point out of the room's sphere, a pixel
/// outside of the picture or without depth. A point behind the camera, or hidden behind what the picture shows (inside
/// of a wall, behind a chair), has light as well: the note says so.
AskedPlace asked_place(const Scene& scene, const LightOptions& options);

/// Rays from a point to the centres of a panorama's pixels, row by row (host/math/panorama.hpp, camera axes).
Rays panorama_rays(const AskedPlace& place, const Size& size);

/// Writes the panorama (EXR, the photograph's unit), a PNG exposed as the photograph, and provenance as JSON beside.
/// Returns a summary as JSON.
std::string light(const LightOptions& options);

}  // namespace clerestory
