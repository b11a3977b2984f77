// The report of a RUN folder, made from what lies in it: `invert`, `insert` and `report` all end here.
#pragma once
#include <filesystem>

namespace clerestory {

/// Writes `folder`/report.html. Throws usage_error when the folder is not a run.
void write_run_report(const std::filesystem::path& folder);

}  // namespace clerestory
