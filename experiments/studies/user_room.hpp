// One room of the study of what a user gets (user_study.hpp): a photograph as a camera takes it, maps predicted from it
// or true, and what each light makes of them, beside the tracer.
#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "experiments/evaluation/radiance_error.hpp"
#include "experiments/evaluation/summary.hpp"
#include "experiments/studies/strip.hpp"
#include "experiments/truth/room_list.hpp"
#include "host/cl/device.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

struct UserOptions {
  int width = 160, height = 120;
  int photo_spp = 256, truth_spp = 1024;  // of the tracer's pictures
  int probes = 4, probe_spp = 64;         // points in free air; paths of a texel in each of two halves
  int seeds = 2;                          // of the layer
  std::vector<std::string> lights;        // names of studies (under_light)
  RenderSettings render;                  // nets and samples of the layer
  std::filesystem::path maps_weights;
};

/// Who does what how well, by which seed of the layer.
struct UserError {
  std::string maps, light, job;  // predicted or true; "render", "air", a ball's name, "around"
  int seed = 0;
  RadianceError error;
};

struct UserRoom {
  std::vector<UserError> errors;
  ViewResult maps;     // predicted ones beside the trivial predictors
  double seconds = 0;  // of a re-render under the first light with predicted maps
  bool ball = false;   // there was a place for one
  std::vector<StripPicture>
      strip;  // photograph, re-renders, the mirror ball: the tracer's and, by predicted maps, each light's
};

inline const std::string kPredictedMaps = "predicted", kTrueMaps = "true";
/// The row of an oracle, which reads the truth: the best multiple of the constant's re-render, the best constant in
/// air.
inline const std::string kOracle = "oracle";
/// The row of the photograph without any ball, for the room around one.
inline const std::string kUnchanged = "unchanged";

/// `means`: the training's mean maps at the view's size, or null.
UserRoom measure_user_room(Device& device, const ListedRoom& room, const UserOptions& options, const MapSet* means);

}  // namespace clerestory
