// What a scene has and what it lacks, read from its maps and its light; what its re-render left out for that, and the
// seconds that this saved.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "nets/render_scene.hpp"

namespace clerestory {

/// Shares are of the pixels that have a depth.
struct SceneTraits {
  double surfaces = 0;   // share of all pixels that have a depth
  double metals = 0;     // metallic above 0.5
  double any_metal = 0;  // metallic above 0
  double mirrors = 0;    // roughness of at most 0.1
  double emitters = 0;
  double least_roughness = 0, most_roughness = 0;
  double normals_off = 0;      // normals_off_depth()
  bool constant_maps = false;  // one albedo and one material everywhere
  bool traces = false;         // the light asks where rays end
  std::size_t lamps = 0;       // out of view
};
SceneTraits traits_of(const Scene& scene, const RenderSettings& settings);
/// SceneTraits::mirrors.
double mirrors_of(const Scene& scene);
/// Median angle, degrees, between normals and what the depth of two neighbours says of them: near 0 where both are
/// measured or true, several degrees where nets predict each by itself. Then rays graze cells that face away.
double normals_off_depth(const Scene& scene);
/// "roughness 0.21 to 0.83, 3.1 % metal, ..."
std::string describe(const SceneTraits& traits);

/// Something that was left out of a re-render, of settings.profile if seconds are to be predicted.
struct Saved {
  Saving saving;
  std::string why;       // the trait, in words and figures
  double rays = 0;       // that were not asked, traced or looked at
  double flops = 0;      // of nets
  double predicted = 0;  // seconds, by what the same run took for the same kind of work; 0: not known
};
std::vector<Saved> saved_in(const SceneTraits& traits, const RenderSettings& settings, const Rendering& rendering);

/// Seconds that each of those saves of `rendering`: about a million of its rays are rendered with all that is left out
/// and without one after the other.
std::map<Saving, double> measure_savings(Device& device, const Scene& scene, const RenderSettings& settings,
                                         const Rendering& rendering);

}  // namespace clerestory
