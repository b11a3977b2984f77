// Pairs of views: a camera and a second one beside it, as a stereo camera has them.
#pragma once
#include <array>
#include <filesystem>
#include <optional>

#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Metres between two cameras where nothing else is said.
inline constexpr double kBaseline = 0.1;

/// The camera `baseline` metres along the x axis of `left`, alike in all else: the pair is rectified. Nothing where a
/// surface stands between the two or within ten centimetres beyond the second one.
std::optional<Camera> right_camera(TraceScene& scene, const Camera& left, double baseline);

/// The pose of a second camera relative to a first, 4x4 row-major, metres: takes points of the second's space to the
/// first's.
std::array<double, 16> relative_pose(const Camera& first, const Camera& second);

/// NNN_right_camera.json and NNN_stereo.json of a view: baseline_m, right_to_left (relative_pose()).
void write_stereo(const std::filesystem::path& room, const std::string& view, const Camera& left, const Camera& right,
                  double exposure);

}  // namespace clerestory
