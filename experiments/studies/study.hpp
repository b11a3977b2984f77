// `clerestory run`: studies, each a config, a run directory and a table.
#pragma once
#include <string>
#include <vector>

#include "experiments/studies/sweep.hpp"
#include "host/io/config.hpp"

namespace clerestory {

/// Keys of the config of a study of that kind, `study.kind`.
Schema study_schema(const std::string& kind);

/// Whether a config names a kind of study; a training's does not.
bool is_study(const std::filesystem::path& config);

/// `study.kind` of a config with overrides, of which any but it may list values: every kind has keys of its own.
std::string study_kind(const std::filesystem::path& config, const std::vector<std::string>& words);

/// The config of a study of any kind with overrides; of those that list values the first.
Config study_config(const std::filesystem::path& config, const std::vector<std::string>& words);

/// Identity of what `clerestory run CONFIG words...` computes, eight hexadecimal digits: config_hash(), or that of the
/// sweep (`many`: by -m).
std::string study_hash(const std::filesystem::path& config, const std::vector<std::string>& words, bool many);

/// Runs the study that the config names into its run directory: finished ones are skipped, partial ones go on. Returns
/// the directory.
std::string run_study(const Config& config, const std::vector<std::string>& command);

/// The tables that a finished study left in its run directory.
RunTables study_tables(const std::filesystem::path& run);

}  // namespace clerestory
