// Where a photographer would stand in a room.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/room.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// How cameras are held. As it is made, level and across the room.
struct Handling {
  double roll = 0;        // degrees: a view is turned about its axis by at most so much, mostly by less
  double close_ups = 0;   // share of the views that look at a piece of furniture from 0.6 to 1.6 m
  double from_above = 0;  // share of those that a standing person has who looks down, at tables and the floor
};

/// The stream of a room's random numbers, Random(seed).fork(..), that its cameras are drawn from.
inline constexpr std::uint64_t kViewsStream = 100;
/// Cameras that are tried for a view.
inline constexpr int kViewCandidates = 24;

/// Cameras in a room: at 0.9 to 1.8 m, 35 to 120 degrees wide, pitched a little, looking across the room and not into a
/// wall or a cupboard at arm's length. Candidates are judged by their maps; where none of a view's candidates is good
/// the best one is taken. Equal arguments give equal cameras. `chosen` gets the number of each view's candidate, 0 to
/// kViewCandidates - 1.
std::vector<Camera> choose_views(TraceScene& scene, const Room& room, int count, int width, int height, Random random,
                                 const Handling& handling = {}, std::vector<int>* chosen = nullptr);
/// The same cameras by these numbers, in a room that the rules made: nothing is traced, so that no device's rounding
/// has a say.
std::vector<Camera> chosen_views(const Room& room, std::span<const int> chosen, int width, int height, Random random,
                                 const Handling& handling = {});

/// What the camera shows, and so how far it stands from it.
enum class Framing { Room, CloseUp, FromAbove };
/// What makes a candidate good, from maps of any size: higher is better, below 0 unfit.
double judge_view(const TraceMaps& maps, Framing framing = Framing::Room);

}  // namespace clerestory
