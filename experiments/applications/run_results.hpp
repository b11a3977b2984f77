// What was made from a run and lies in its folder: `insert`, `edit` and `light` leave records there.
#pragma once
#include <filesystem>
#include <vector>

#include "host/report/provenance.hpp"

namespace clerestory {

/// A result and where its picture lies.
struct RunResult {
  std::filesystem::path picture;  // the photograph with objects or another material, or a panorama
  Provenance record;
};

/// What was made from the photograph that the run has now, in its folder and in folders directly in it, by name. A
/// folder in it that is a run itself (an edit) has what was made from it on its own page.
struct RunResults {
  std::vector<RunResult> insertions, edits, panoramas;
};
RunResults results_of_run(const std::filesystem::path& run);

/// Of the records of `light`, `edit` and `insert`.
inline constexpr const char* kPointFact = "point, camera metres";
inline constexpr const char* kEditFact = "edit";
inline constexpr const char* kInsertRecord = "insert.json";

}  // namespace clerestory
