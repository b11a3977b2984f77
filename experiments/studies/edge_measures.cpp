#include "experiments/studies/edge_measures.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/predict.hpp"
#include "experiments/evaluation/edge_band.hpp"
#include "experiments/training/view_store.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr int kReach = 3;  // pixels to each side of an edge

MapSet maps_of(const Prediction& p) {
  MapSet maps{p.albedo, p.normal, p.depth, Image(p.depth.width, p.depth.height, 2)};
  std::copy_n(p.material.data.begin(), maps.material.data.size(), maps.material.data.begin());
  return maps;
}

/// The mean over views, or nothing.
Cell mean_cell(const std::vector<EdgeErrors>& views, MapErrors EdgeErrors::*where, std::size_t map) {
  std::vector<double> errors;
  for (const EdgeErrors& v : views)
    if (const auto& e = (v.*where)[map]) errors.push_back(*e);
  return errors.empty() ? Cell() : Cell(Measure{mean(errors)});
}

}  // namespace

EdgeErrors edge_errors(const std::string& view, const MapSet& predicted, const MapSet& truth, const MapMasks& masks) {
  const MapMasks band = edge_bands(truth, masks, kReach);
  return {view, truth.depth.width, truth.depth.height, map_errors(predicted, truth, band),
          map_errors(predicted, truth, without(masks, band))};
}

std::vector<EdgeErrors> measure_edges(const std::filesystem::path& weights, const std::filesystem::path& test,
                                      Device& device) {
  const std::vector<ViewName> names = name_views({test.string()}, "test");
  std::vector<EdgeErrors> views;
  Progress bar("edges", static_cast<std::int64_t>(names.size()), "views");
  for (const ViewName& name : names) {
    stop_if_interrupted("study");
    const RoomView view = read_view(name.room, name.id);
    const PreparedView truth = prepare_view(view, view.depth.width, view.depth.height);
    const MapSet predicted = maps_of(predict_maps(device, weights, truth.image, {}));
    views.push_back(edge_errors(name.text(), predicted, truth.truth, truth.masks));
    bar.advance();
  }
  return views;
}

Table edge_table(const std::vector<EdgeErrors>& views) {
  Table table;
  table.title = fmt::format("Maps along their edges, {} views of unseen rooms", views.size());
  table.note = fmt::format(
      "Views of {}x{}. Along edges: at most {} pixels from where the true map steps (docs/results.md); away from "
      "edges: all "
      "other pixels of that map. Predicted maps are brought to this size as `invert` does.",
      views.front().width, views.front().height, kReach);
  table.columns = {{"map"}, {"along edges", "", Best::Lowest, 4}, {"away from edges", "", Best::Lowest, 4}};
  for (std::size_t m = 0; m < map_error_count; ++m) {
    const MapErrorInfo& error = info(static_cast<MapError>(m));
    table.add({fmt::format("{}, {}", error.name, error.unit), mean_cell(views, &EdgeErrors::along, m),
               mean_cell(views, &EdgeErrors::elsewhere, m)});
  }
  return table;
}

std::vector<JudgedErrorsList> edge_lists(const std::vector<EdgeErrors>& views) {
  const auto list = [&](const char* name, MapErrors EdgeErrors::*where) {
    JudgedErrorsList all{name, {}};
    for (const EdgeErrors& v : views) {
      std::vector<double> errors;
      for (const auto& e : v.*where) errors.push_back(e.value_or(NAN));
      all.views.push_back(judged_errors(v.view, std::move(errors)));
    }
    return all;
  };
  return {list("along edges", &EdgeErrors::along), list("away from edges", &EdgeErrors::elsewhere)};
}

}  // namespace clerestory
