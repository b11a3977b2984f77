// What trained maps are worth: their table for studies of trainings.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/studies/sweep.hpp"

namespace clerestory {

struct MapMeasuring {
  std::filesystem::path test;                 // folder of views that no training saw, with its list "test"
  std::vector<std::filesystem::path> frames;  // photographs with measured depth
  std::string device, gemm = "auto";
  std::vector<std::string> measures = {};  // of map_measures(), beside the errors of the maps
};

/// "edges": errors along the edges of the true maps (edge_measures.hpp), which also go into the run's kMeasuredErrors.
const std::vector<std::string>& map_measures();

/// Judges a finished training's last weights: table "maps", a row for each map and each photograph, with its error, its
/// ratio to the best trivial answer, and what the training cost; and the tables asked for.
RunTables measure_maps(const std::filesystem::path& run, const MapMeasuring& options);

}  // namespace clerestory
