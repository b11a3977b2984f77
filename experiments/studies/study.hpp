// `clerestory run`: studies, each a config, a run directory and a table.
#pragma once
#include <string>
#include <vector>

#include "experiments/sweep.hpp"
#include "host/io/config.hpp"

namespace clerestory {

/// Keys of a study's config: `study.kind` says which.
Schema study_schema();

/// Runs the study that the config names into its run directory: finished ones are skipped, partial ones go on. Returns
/// the directory.
std::string run_study(const Config& config, const std::vector<std::string>& command);

/// The tables that a finished study left in its run directory.
RunTables study_tables(const std::filesystem::path& run);

}  // namespace clerestory
