// Ablations by short trainings: maps or the light trained anew for each variant and seed of one config, at equal time,
// and judged on rooms that no training saw.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of such a study: all of training_schema(), `study.kind` = training, and its own under `ablation`.
Schema training_study_schema();
/// The latter alone.
void add_ablation_keys(Schema& schema);

/// Makes the rooms that are missing, then for each variant of the config, each combination of the values that `words`
/// list and each seed: trains (run.root/run.experiment/...), judges, and in the end writes and prints tables over all
/// (run_sweep). Finished parts are skipped, an interrupted training goes on from its checkpoint. A variant that fails
/// lets the others go on. Returns the folder of the tables. With `only`, a name of training_study_names(), it makes
/// that run and no tables, and returns its directory. Throws what run_sweep() and generate() throw, usage_error when
/// maps are to be judged by tables of the light.
std::filesystem::path run_training_study(const std::filesystem::path& config, const std::vector<std::string>& words,
                                         const std::vector<std::string>& fixed, const std::vector<std::string>& command,
                                         const std::string& only = {});

/// sweep_names() of its variants, seeds and `words`.
std::vector<std::string> training_study_names(const std::filesystem::path& config,
                                              const std::vector<std::string>& words,
                                              const std::vector<std::string>& fixed);

/// Identity of what it would run: sweep_hash() of its variants, seeds and `words`.
std::string training_study_hash(const std::filesystem::path& config, const std::vector<std::string>& words);

}  // namespace clerestory
