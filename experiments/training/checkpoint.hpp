// Checkpoints (all states in float, exactly) and weights (what inference needs, in half), as safetensors.
#pragma once
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/training/history.hpp"
#include "experiments/training/moments.hpp"
#include "host/graph/plan.hpp"
#include "host/io/safetensors.hpp"
#include "nets/light_model.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// Where a run stands, beside its states.
struct TrainingProgress {
  std::int64_t step = 0;          // steps done
  double seconds = 0;             // of this leg, breaks not counted
  double best_score = 1e30;       // of a validation so far
  std::vector<double> loss_sums;  // since the last line of metrics
  std::int64_t summed = 0;        // steps in loss_sums
  std::int64_t moment_steps = 0;  // of the earlier legs that second moments were taken over from
  History history;                // of earlier legs, and this one so far
  std::optional<MeanMaps> means;
};

/// What a checkpoint must agree with to be gone on from.
struct RunIdentity {
  std::string preset;
  std::string net;  // net_text() or light_text()
  Size size;
  std::uint64_t seed = 0;
  std::string config_hash;
  std::uint64_t views_hash = 0;
};

/// Throws Error (Failed) naming the first state that holds a NaN or Inf, and where: such a checkpoint is not written.
void write_checkpoint(const std::filesystem::path& path, const States& states, const TrainingProgress& progress,
                      const RunIdentity& identity);
/// Sets every state to what a checkpoint holds, bit for bit, and returns the progress. `file` is whole and finite
/// (read_finite_safetensors). Throws usage_error naming `where`, its path, and the tensor when it is no checkpoint,
/// belongs to another run or data set, lacks a state, or has one of another shape.
TrainingProgress go_on_from(const TensorFile& file, const std::string& where, States& states,
                            const RunIdentity& identity);

/// Facts that travel with weights, beside the history: see write_weights for the keys.
struct WeightsFacts {
  std::string preset;
  std::string net;  // net_text() or light_text()
  Size size;
  std::string commit;
  std::map<std::string, Shape> states;  // that go into the file
  Moments moments = {};
};
/// Inference tensors and factors of second moments in half precision with metadata (kind = weights, preset, net, width,
/// height, longer_side, numbers, scale_error, hours, views_seen, seeds, commit, score, errors by key, history as JSON)
/// and the training set's mean maps.
void write_weights(const std::filesystem::path& path, const States& states, const History& history,
                   const std::optional<MeanMaps>& means, const WeightsFacts& facts);

/// The light's parts in a folder: light_local.safetensors has the states "local.*", light_global.safetensors
/// "global.*". Metadata as write_weights gives them, but kind = light, and part = local or global.
void write_light(const std::filesystem::path& folder, const States& states, const History& history,
                 const WeightsFacts& facts);

/// The files behind weights that a user names: both parts for a folder, which is a light's; else the file itself.
std::vector<std::filesystem::path> weights_files(const std::filesystem::path& path);

/// Weights or a checkpoint to start from, for a light also the folder of its parts: sets the states that inference
/// needs, and second moments where the file has them and `states` too. Throws usage_error naming file, tensor, found
/// and expected shape.
struct InitialWeights {
  History history;
  std::int64_t moment_steps = 0;  // steps behind the second moments that came with them; 0: none came
};
InitialWeights read_initial_weights(const std::filesystem::path& path, States& states, const std::string& net,
                                    const std::map<std::string, Shape>& wanted);

/// Sets the states of scope "encoder" from a file that holds them alone, learned on something else.
/// Throws usage_error naming file, tensor, found and expected shape.
void read_encoder_weights(const std::filesystem::path& path, States& states,
                          const std::map<std::string, Shape>& wanted);

/// What a weights file or checkpoint says of its training; without legs when it says nothing.
History read_history(const std::filesystem::path& path);

/// Second moments of a weights file, a checkpoint or a light's folder; none where it has none.
Moments read_moments(const std::filesystem::path& path);

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
