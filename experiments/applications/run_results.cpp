#include "experiments/applications/run_results.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> sorted_in(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder))
    if (!entry.path().filename().string().starts_with('.')) paths.push_back(entry.path());
  std::ranges::sort(paths);
  return paths;
}

/// What lies in a run's folder and may have been made from it.
class Search {
 public:
  explicit Search(const fs::path& run) : photo_(file_hash(run / "photo.exr")) {}

  void look_into(const fs::path& folder) {
    add(folder / kInsertRecord, folder / "composite.exr", nullptr, found.insertions);
    for (const fs::path& file : sorted_in(folder))
      if (file.extension() == ".exr") add(fs::path(file).replace_extension(".json"), file, kPointFact, found.panoramas);
  }
  /// Its composite may by now hold objects too; its photograph is the edit alone.
  void look_at_run(const fs::path& folder) {
    add(folder / kProvenanceName, folder / "photo.exr", kEditFact, found.edits);
  }

  RunResults found;

 private:
  /// A result if both files are there, the record has the fact (if any), and the run's photograph is what it is made
  /// from; else it is somebody's own.
  void add(const fs::path& record, const fs::path& picture, const char* fact, std::vector<RunResult>& to) const {
    if (!fs::is_regular_file(record) || !fs::is_regular_file(picture)) return;
    try {
      Provenance made = read_provenance(record);
      if (fact && !made.facts.contains(fact)) return;
      if (!made.inputs.empty() && made.inputs[0].hash == photo_) to.push_back({picture, std::move(made)});
    } catch (const Error&) {  // no record of ours
    }
  }

  std::string photo_;  // its hash
};

}  // namespace

RunResults results_of_run(const fs::path& run) {
  Search search(run);
  search.look_into(run);
  for (const fs::path& folder : sorted_in(run)) {
    if (!fs::is_directory(folder)) continue;
    if (fs::exists(folder / kProvenanceName))
      search.look_at_run(folder);
    else
      search.look_into(folder);
  }
  return std::move(search.found);
}

}  // namespace clerestory
