// What trained maps are worth along the edges of true ones, which a mean over all pixels hides.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/evaluation/metrics.hpp"
#include "experiments/training/judged_views.hpp"
#include "host/cl/device.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// Errors of a view's maps at most three rows and columns from an edge of the true map (edge_bands), and of the rest.
struct EdgeErrors {
  std::string view;  // FOLDER/ROOM/VIEW
  int width = 0, height = 0;
  MapErrors along, elsewhere;
};
EdgeErrors edge_errors(const std::string& view, const MapSet& predicted, const MapSet& truth, const MapMasks& masks);

/// Judges weights of maps on the list "test" of a folder of rooms, each view at its file's own size: maps are predicted
/// and brought to that size as `invert` does. Throws usage_error when there is no view, or the weights do not fit.
std::vector<EdgeErrors> measure_edges(const std::filesystem::path& weights, const std::filesystem::path& test,
                                      Device& device);

/// A row for each map: the mean over the views that have an error there.
Table edge_table(const std::vector<EdgeErrors>& views);

/// The same by view: two lists, along edges and elsewhere, for room_differences().
std::vector<JudgedErrorsList> edge_lists(const std::vector<EdgeErrors>& views);

}  // namespace clerestory
