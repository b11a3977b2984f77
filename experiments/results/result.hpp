// A result: the tables of one study at full size, and what they rest on. docs/results/NAME.json is the one place where
// figures stand; Markdown, plots and the blocks of README and docs are made from it.
#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "experiments/studies/sweep.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {

/// What made the figures: `clerestory run CONFIG KEY=VALUE...`.
struct ResultCommand {
  std::string config;                  // relative to the source tree
  std::vector<std::string> overrides;  // without those that change no figure (run.root, run.device...)
  bool many = false;                   // -m

  std::string text() const;
};

/// The column that the plot shows.
struct PlottedColumn {
  std::string table, column;
};

struct Result {
  std::string name, title;
  ResultCommand command;
  std::string config_hash;                      // study_hash() at the time
  std::map<std::string, std::string> kernels;   // built_kernels() of all that it took
  std::map<std::string, std::string> settings;  // what the config sets, as TOML values
  std::string commit;                           // of the program, "(changed)" behind it where the tree was not clean
  std::string device;                           // fingerprint
  std::vector<FileRecord> inputs;               // weights and lists of rooms, relative to the source tree
  RoomsRecord rooms;
  std::map<std::string, std::uint64_t> seeds;
  std::map<std::string, std::string> notes;  // facts that the study states
  double minutes = 0;
  PlottedColumn plotted;
  RunTables tables;
};

/// What a finished run directory, or folder of a sweep, of `clerestory run` holds. `plotted`: parts left empty are
/// chosen: the first table and column whose best is marked, else the first with numbers. Throws ErrorKind::Usage when
/// the run is not done, was made by another command, has no tables or no such column, rests on files outside of `tree`,
/// was made with another config than the file now holds, or when a path of this machine would be told.
Result result_of_run(const std::filesystem::path& run, const std::string& name, const std::string& title,
                     const PlottedColumn& plotted, const std::filesystem::path& tree);

std::string result_json(const Result& result);
/// Throws ErrorKind::Usage naming the file.
Result read_result(const std::filesystem::path& json);

/// Head (what was run, on what), tables, plot. A function of the JSON alone.
std::string result_markdown(const Result& result);
/// The plotted column, a dot for each row with a bar of its spread; ends in plot_mark(). Throws what plot_svg() throws.
std::string result_svg(const Result& result);
/// A comment that tells from which figures a plot was drawn.
std::string plot_mark(const Result& result);

/// docs/results of a source tree, and NAME.json in it.
std::filesystem::path results_folder(const std::filesystem::path& tree);
std::filesystem::path result_file(const std::filesystem::path& tree, const std::string& name);
/// Names of all NAME.json, sorted.
std::vector<std::string> result_names(const std::filesystem::path& tree);

/// NAME.json, .md and .svg: all are made before the first is written.
void write_result(const Result& result, const std::filesystem::path& tree);

}  // namespace clerestory
