// Checkpoints (all states in float, exactly) and weights (what inference needs, in half), as safetensors.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/training/history.hpp"
#include "host/graph/plan.hpp"
#include "host/io/safetensors.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// Where a run stands, beside its states.
struct TrainingProgress {
  std::int64_t step = 0;          // steps done
  double seconds = 0;             // of this leg, breaks not counted
  double best_score = 1e30;       // of a validation so far
  std::vector<double> loss_sums;  // since the last line of metrics
  std::int64_t summed = 0;        // steps in loss_sums
  History history;                // of earlier legs, and this one so far
  std::optional<MeanMaps> means;
};

/// What a checkpoint must agree with to be gone on from.
struct RunIdentity {
  std::string preset;
  std::string net;  // net_text()
  Size size;
  std::uint64_t seed = 0;
  std::string config_hash;
  std::uint64_t views_hash = 0;
};

/// Throws Error (Failed) naming the first state that holds a NaN or Inf: such a checkpoint is not written.
void write_checkpoint(const std::filesystem::path& path, const States& states, const TrainingProgress& progress,
                      const RunIdentity& identity);
/// Sets every state, bit for bit, and returns the progress. Throws usage_error naming file and tensor when the file is
/// no checkpoint, belongs to another run or data set, lacks a state, or has one of another shape.
TrainingProgress read_checkpoint(const std::filesystem::path& path, States& states, const RunIdentity& identity);

/// Facts that travel with weights, beside the history: see write_weights for the keys.
struct WeightsFacts {
  std::string preset;
  std::string net;  // net_text()
  Size size;
  std::string commit;
  std::map<std::string, Shape> states;  // that go into the file
};
/// Inference tensors in half precision with metadata (kind, preset, net, width, height, longer_side, parameters,
/// scale_error, hours, views_seen, seeds, commit, score, errors by key, history as JSON) and the training set's mean
/// maps.
void write_weights(const std::filesystem::path& path, const States& states, const History& history,
                   const std::optional<MeanMaps>& means, const WeightsFacts& facts);

/// Weights or a checkpoint to start from: sets the states that inference needs. Returns the history they carry. Throws
/// usage_error naming file, tensor, found and expected shape.
History read_initial_weights(const std::filesystem::path& path, States& states, const std::string& net,
                             const std::map<std::string, Shape>& wanted);

/// Weights for evaluation: preset, size, mean maps when stored, and states ready for MapPredictor.
struct LoadedWeights {
  std::string preset;
  MgnetSize net;
  Size size;  // of the training views
  History history;
  std::optional<MeanMaps> means;
  std::map<std::string, std::string> metadata;
  std::shared_ptr<States> states;
};
LoadedWeights load_weights(const std::filesystem::path& path, Device device);

}  // namespace clerestory
