// Where a photographer would stand in a room.
#pragma once
#include <vector>

#include "tracer/room.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Cameras in a room: at 0.9 to 1.8 m, 35 to 120 degrees wide, pitched a little, looking across the room and not into a
/// wall or a cupboard at arm's length. Candidates are judged by their maps; where none of a view's candidates is good
/// the best one is taken. Equal arguments give equal cameras.
std::vector<Camera> choose_views(TraceScene& scene, const Room& room, int count, int width, int height, Random random);

/// What makes a candidate good, from maps of any size: higher is better, below 0 unfit.
double judge_view(const TraceMaps& maps);

}  // namespace clerestory
