// One room of the oracle ladder (ladder_study.hpp): its pictures at every rung, and how far they are from the tracer's.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "experiments/studies/findings.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/linked_light.hpp"
#include "experiments/truth/room_list.hpp"

namespace clerestory {

struct Rung {
  std::string key;
  Links links;
  bool true_maps;
};
/// All predicted first, all true last.
const std::vector<Rung>& rungs();

/// Rows beside the rungs: lights without nets, the nets with lamps, the best multiple of the constant, a ball under the
/// tracer's light of the room that holds it.
const std::vector<std::string>& plain_lights();
std::string plain_key(const std::string& light, bool true_maps);
inline const std::string kBestConstant = "oracle: best constant, true maps",
                         kWithBall = "all true, the ball in the room";

struct LadderOptions {
  int width = 160, height = 120;
  int picture_spp = 512;    // of the tracer's pictures, in two halves
  int emission_spp = 1024;  // of true light from emitters
  int seeds = 3;            // of the layer, at least 2
  RenderSettings render;    // light = net, with its nets; samples a pixel of the layer
  std::filesystem::path maps_weights;
};

struct LadderRoom {
  RoomFindings found;  // relmse, psnr and seconds of each region (render, and the balls by name), row and seed
  /// By job: the tracer's picture, then one a rung.
  std::vector<std::pair<std::string, std::vector<StripPicture>>> strips;
};
LadderRoom climb_ladder(Device& device, const ListedRoom& room, const LadderOptions& options);

}  // namespace clerestory
