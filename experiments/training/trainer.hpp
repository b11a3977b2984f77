// One leg of training in a run directory: batches, steps, validation, checkpoints, report.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/training/options.hpp"

namespace clerestory {

struct TrainingOutcome {
  std::filesystem::path folder;   // of the run
  std::filesystem::path weights;  // artifacts/weights.safetensors
  bool skipped = false;           // the run was finished before
};

/// Runs or resumes the leg that `config` describes. A resumed leg ends in the same bits as one that was never
/// interrupted, unless train.minutes limits it. Throws Error: Usage (config, data, weights), Failed (a training that
/// diverges: a loss, gradient, parameter or score that is not finite, or a loss that has run away, naming step, tensor
/// and the last good checkpoint; a full disk), Interrupted (after a checkpoint; the same command goes on).
TrainingOutcome train(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
