// The report of a run directory of `train` or `run`, made from what lies in it.
#pragma once
#include <filesystem>

namespace clerestory {

/// Whether `folder` is a run directory: it holds config.resolved.toml.
bool is_run_directory(const std::filesystem::path& folder);

/// Writes `folder`/report.html: of the artifacts the first table (*.table.json) by name, plots (*.svg) and pictures
/// (*.png), the other tables, a plot for every group of curves in metrics.jsonl ("val/depth" belongs to group "val");
/// then facts of provenance.json, config and log. It names no folder of the computer that made it. An unfinished run
/// gets the report of what there is. `finishing`: the run is done
/// as soon as it has this report.
void write_run_directory_report(const std::filesystem::path& folder, bool finishing = false);

}  // namespace clerestory
