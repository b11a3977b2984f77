// Weights: what inference needs, in half precision, with how it came to be, as safetensors.
#pragma once
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/weights/history.hpp"
#include "experiments/weights/moments.hpp"
#include "host/graph/plan.hpp"
#include "host/io/resize.hpp"
#include "nets/mgnet.hpp"
#include "nets/mixed_light.hpp"

namespace clerestory {

/// Facts that travel with weights, beside the history: see write_weights for the keys.
struct WeightsFacts {
  std::string preset;
  std::string net;  // net_text() or light_text()
  Size size;
  std::string commit;
  std::map<std::string, Shape> states;  // that go into the file
  Moments moments = {};
  double gain = 1;  // of the light out of view (OutOfViewSize)
};
/// Inference tensors and factors of second moments in half precision with metadata (kind = weights, preset, net, width,
/// height, longer_side, numbers, scale_error, hours, views_seen, seeds, commit, score, errors by key, history as JSON)
/// and the training set's mean maps.
void write_weights(const std::filesystem::path& path, const States& states, const History& history,
                   const std::optional<MeanMaps>& means, const WeightsFacts& facts);

/// The light's parts in a folder: light_local.safetensors has the states "local.*", light_global.safetensors
/// "global.*". Metadata as write_weights gives them, but kind = light, part = local or global, and gain.
void write_light(const std::filesystem::path& folder, const States& states, const History& history,
                 const WeightsFacts& facts);

/// The files behind weights that a user names: both parts for a folder, which is a light's; else the file itself.
std::vector<std::filesystem::path> weights_files(const std::filesystem::path& path);

/// Weights or a checkpoint to start from, for a light also the folder of its parts: sets the states that inference
/// needs (of a checkpoint the averages, where it has them), and second moments where the file has all of them. Throws
/// usage_error naming file, tensor, found and expected shape.
struct InitialWeights {
  History history;
  std::int64_t moment_steps = 0;  // steps behind the second moments that came with them; 0: none came
  Moments kept;                   // of parameters that this leg does not train
  std::optional<MeanMaps> means;
};
InitialWeights read_initial_weights(const std::filesystem::path& path, States& states, const std::string& net,
                                    const std::map<std::string, Shape>& wanted);

/// Sets the states of scope "encoder", and of a light's "local.encoder" and "global.encoder", from a file that holds an
/// encoder alone, learned on something else. Throws usage_error naming file, tensor, found and expected shape.
void read_encoder_weights(const std::filesystem::path& path, States& states,
                          const std::map<std::string, Shape>& wanted);

/// What a weights file or checkpoint says of its training; without legs when it says nothing.
History read_history(const std::filesystem::path& path);

/// Second moments of a weights file, a checkpoint or a light's folder; none where it has none.
Moments read_moments(const std::filesystem::path& path);

/// What nets weights are of, as their metadata say: of the maps, or of the light as load_light() takes them. Throws
/// usage_error naming the file when it is of the other kind or says nothing that makes sense.
MgnetSize read_maps_size(const std::filesystem::path& path);
LightSizes read_light_sizes(const std::filesystem::path& path);
/// Of OutOfViewSize::gain, which belongs to no net's text: a leg that goes on learns anew.
inline constexpr double kMostGain = 100;

/// What weights of either kind hold for inference.
struct LoadedStates {
  std::string preset;
  Size size;  // of the training views
  History history;
  std::map<std::string, std::string> metadata;  // a light's: of its local part
  std::shared_ptr<States> states;
};

/// Weights of the maps, ready for MapPredictor; mean maps when stored. Throws usage_error naming the file when it is a
/// light's.
struct LoadedWeights : LoadedStates {
  MgnetSize net;
  std::optional<MeanMaps> means;
};
LoadedWeights load_weights(const std::filesystem::path& path, Device device);

/// Weights of the light: states "local.*" and "global.*".
struct LoadedLight : LoadedStates {
  LightSizes net;
  int longer_side() const { return std::max(size.width, size.height); }
};
/// From the folder of its parts, or from one weights file or checkpoint of a training of kind light. Throws usage_error
/// naming the file that is missing, is for maps, is the other part, comes from another net or training than its twin,
/// or lacks a tensor or has one of another shape.
LoadedLight load_light(const std::filesystem::path& path, Device device);

}  // namespace clerestory
