// Checkpoints: all states in float, exactly, and where a run stands, as safetensors.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/evaluation/mean_maps.hpp"
#include "experiments/weights/history.hpp"
#include "experiments/weights/moments.hpp"
#include "host/graph/plan.hpp"
#include "host/io/resize.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

/// Where a run stands, beside its states.
struct TrainingProgress {
  std::int64_t step = 0;          // steps done
  double seconds = 0;             // of this leg, breaks not counted
  double best_score = 1e30;       // of a validation so far
  std::vector<double> loss_sums;  // since the last line of metrics
  std::int64_t summed = 0;        // steps in loss_sums
  std::int64_t moment_steps = 0;  // of the earlier legs that second moments were taken over from
  Moments kept;                   // second moments of what earlier legs trained and this one does not
  History history;                // of earlier legs, and this one so far
  std::optional<MeanMaps> means;  // of the views that the first leg began with
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

/// Throws NotFinite (stored_states.hpp) for the first state that holds a NaN or Inf: such a checkpoint is not written.
void write_checkpoint(const std::filesystem::path& path, const States& states, const TrainingProgress& progress,
                      const RunIdentity& identity);
/// Sets every state to what a checkpoint holds, bit for bit, and returns the progress. `file` is whole and finite
/// (read_finite_safetensors). Throws usage_error naming `where`, its path, and the tensor when it is no checkpoint,
/// belongs to another run or data set, lacks a state, or has one of another shape.
TrainingProgress go_on_from(const TensorFile& file, const std::string& where, States& states,
                            const RunIdentity& identity);

}  // namespace clerestory
