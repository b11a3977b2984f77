// How the path tracer chooses points on lights: tables that kernels/trace reads.
#pragma once
#include <vector>

#include "tracer/scene.hpp"

namespace clerestory {

/// Rows as in kernels/trace/scene.clh.
struct LightTables {
  std::vector<float> emitters;  // {emitters, 8}
  std::vector<float> lights;    // {lights, 16}: one per emitting triangle
  std::vector<float> cdf;       // {lights}
  std::vector<float> sky;       // rows' and columns' running sums, density by solid angle; empty without panes
  float sky_share = 0;          // probability of choosing by the sky's direction
  std::vector<int> panes;       // triangles that show the panorama
  int light_count() const { return static_cast<int>(cdf.size()); }
};

/// Lights are chosen by luminous power. Where panes emit, up to half of the choices go by direction instead: small
/// bright parts of the panorama (the sun, lamps) that light only some places would be found too seldom by area.
LightTables make_light_tables(const World& scene);

}  // namespace clerestory
