// Rooms as scenes of Mitsuba 3, so that another renderer can check the path tracer: scene.xml, a PLY file for each
// mesh, the panorama as EXR. The materials and panes are plug-ins of experiments/peers/clerestory_brdf.py.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "host/math/camera.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// Triangles of one material and one emitter, as a file holds them: vertices in rows of nine floats (position, normal,
/// uvw), equal ones once, and three of them for each triangle. Triangles without area are left out.
struct MitsubaMesh {
  int material = 0, emitter = -1;
  bool smooth = false;  // whether a normal differs from its triangle's
  double area = 0;
  std::vector<float> vertices;
  std::vector<std::int32_t> indices;
};
std::vector<MitsubaMesh> mitsuba_meshes(const World& world);

/// Writes the folder, which must not exist yet, whole or not at all: what is unfinished has another name, and is
/// removed by the next call. The integrator is Mitsuba's `path` with the tracer's longest path; each camera is a sensor
/// named view-000, view-001, ... Throws usage_error when a camera's pixels are not square, which Mitsuba has no word
/// for.
void write_mitsuba_scene(const std::filesystem::path& folder, const World& world, const std::vector<Camera>& cameras);

}  // namespace clerestory
