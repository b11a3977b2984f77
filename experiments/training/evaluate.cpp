#include "experiments/training/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "experiments/training/validation.hpp"
#include "experiments/weights/map_predictor.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

std::optional<MeanMaps> mean_maps(const EvaluateOptions& options, const LoadedWeights& weights) {
  if (options.mean_data.empty()) return weights.means;
  ViewStore store(name_views({options.mean_data.string()}, "train"), weights.size.width, weights.size.height, 0);
  MeanMaps means;
  Progress bar("training mean", static_cast<std::int64_t>(store.size()), "views");
  for (std::size_t i = 0; i < store.size(); ++i) {
    means.add(store.get(i));
    bar.advance();
    stop_if_interrupted("evaluate");
  }
  return means.as_stored();
}

void judge_data(const EvaluateOptions& options, const LoadedWeights& weights, const std::optional<MeanMaps>& means,
                MapPredictor& predictor, EvaluateOutcome& out) {
  std::string split = options.split;
  ViewStore store(views_to_judge(options.data, split), weights.size.width, weights.size.height, 0);
  std::set<std::string> rooms;
  for (const ViewName& name : store.names()) rooms.insert(name.room.string());
  out.facts.emplace_back(
      "data", fmt::format("{} ({}): {} views of {} rooms", options.data.string(), split, store.size(), rooms.size()));
  const std::optional<MapSet> mean =
      means ? std::optional(means->maps(weights.size.width, weights.size.height)) : std::nullopt;
  Progress bar("evaluate", static_cast<std::int64_t>(store.size()), "views");
  const std::size_t batch = static_cast<std::size_t>(options.batch);
  for (std::size_t first = 0; first < store.size(); first += batch) {
    std::vector<std::size_t> which;
    for (std::size_t i = first; i < std::min(store.size(), first + batch); ++i) which.push_back(i);
    std::vector<JudgedView> views = read_for_judgement(store, which, mean ? &*mean : nullptr);
    judge_all(views, predictor);
    for (JudgedView& v : views)
      if (options.rivals) v.result.rivals = rival_errors(v.view);
    for (ViewResult& r : results_of(views)) out.views.push_back(std::move(r));
    bar.update(static_cast<std::int64_t>(out.views.size()));
    stop_if_interrupted("evaluate");
  }
  out.summary = summarise(out.views);
}

void judge_frames(const EvaluateOptions& options, const LoadedWeights& weights, const std::optional<MeanMaps>& means,
                  MapPredictor& predictor, EvaluateOutcome& out) {
  const int longer = std::max(weights.size.width, weights.size.height);
  for (const fs::path& folder : options.frames)
    out.frames.push_back(judge(read_frame(folder, longer), predictor, means));
}

std::vector<std::string> conventions_of(int width, int height, bool rivals) {
  std::vector<std::string> lines = evaluation_conventions(width, height);
  lines.push_back(kPredictionConvention);
  if (rivals) std::ranges::copy(rival_conventions(), std::back_inserter(lines));
  return lines;
}

}  // namespace

std::vector<ViewName> views_to_judge(const fs::path& data, std::string& split) {
  if (!fs::is_directory(data)) throw usage_error("no such folder", data.string());
  if (split.empty())
    for (const char* candidate : {"test", "val"})
      if (split.empty() && fs::exists(data / (std::string(candidate) + ".txt"))) split = candidate;
  if (!split.empty()) return name_views({data.string()}, split);
  std::vector<ViewName> views;
  std::set<fs::path> rooms;
  for (const auto& entry : fs::directory_iterator(data))
    if (entry.is_directory()) rooms.insert(entry.path());
  for (const fs::path& room : rooms)
    for (const std::string& id : list_views(room)) views.push_back({room, id});
  if (views.empty())
    throw usage_error("there is no view", data.string(), "no NNN_im.exr in its folders",
                      "rooms written by `clerestory generate`");
  split = "every folder";
  return views;
}

EvaluateOutcome evaluate_weights(const EvaluateOptions& options) {
  if (options.data.empty() && options.frames.empty())
    throw usage_error("there is nothing to judge", "evaluate", "", "--data DIR, --frames DIR, or both");
  catch_interrupts();
  Device device = Device::open(options.device);
  device.use_tile(options.tile), device.use_gemm(options.gemm);
  const LoadedWeights weights = load_weights(options.weights, device);
  MapPredictor predictor(device, weights.net, weights.states, options.batch);
  const std::optional<MeanMaps> means = mean_maps(options, weights);

  EvaluateOutcome out;
  out.facts = {{"weights", options.weights.string()},
               {"weights hash", file_hash(options.weights)},
               {"net", weights.preset + ": " + net_text(weights.net)},
               {"hours of training", fmt::format("{:.2f}", weights.history.hours())},
               {"device", device.info().name},
               {"training mean",
                means ? fmt::format("of {} views, {}x{}", means->views(), MeanMaps::grid_width, MeanMaps::grid_height)
                      : "none: these weights hold no mean maps and --mean-data was not given"}};
  if (!options.data.empty()) judge_data(options, weights, means, predictor, out);
  if (!options.frames.empty()) judge_frames(options, weights, means, predictor, out);
  out.conventions = conventions_of(weights.size.width, weights.size.height, options.rivals);
  out.conventions.push_back(fmt::format(
      "photographs: longer side {}; measured depth by nearest neighbour, every pixel with a measurement counts",
      std::max(weights.size.width, weights.size.height)));
  return out;
}

namespace {

/// What the run says it was made of, and whether that is the view's own picture.
std::string photograph_of(const fs::path& run, const fs::path& picture) {
  if (!fs::exists(run / kProvenanceName)) return "not recorded";
  const std::vector<FileRecord> inputs = read_provenance(run / kProvenanceName).inputs;
  if (inputs.empty()) return "not recorded";
  return inputs[0].path + (inputs[0].hash == file_hash(picture) ? "" : ", other bytes than " + picture.string());
}

}  // namespace

EvaluateOutcome evaluate_run(const fs::path& run, const fs::path& view, bool rivals) {
  const GBuffer maps = read_gbuffer(run);
  if (!maps.albedo || !maps.normal || !maps.depth || !maps.material)
    throw usage_error("a map is missing", run.string(), "",
                      "albedo.exr, normal.exr, depth.exr and material.exr of `clerestory invert`");
  if (!is_view(view)) throw usage_error("is no generated view", view.string(), "", "ROOM/NNN with ROOM/NNN_im.exr");
  const int width = maps.depth->width, height = maps.depth->height;
  const RoomView truth = read_view(view);
  if (net_size(truth.depth.width, truth.depth.height, std::max(width, height)) != Size{width, height})
    throw usage_error("the run and the view have other proportions", run.string(), fmt::format("{}x{}", width, height),
                      fmt::format("those of {}x{}", truth.depth.width, truth.depth.height));

  const PreparedView prepared = prepare_view(truth, width, height);
  MapSet predicted{*maps.albedo, *maps.normal, *maps.depth, Image(width, height, 2)};
  std::copy_n(maps.material->data.begin(), predicted.material.data.size(), predicted.material.data.begin());
  const double scale = scene_scale(predicted.depth.data, run.string());
  for (float& d : predicted.depth.data) d /= static_cast<float>(scale);
  ViewResult result = trivial_errors(view.string(), prepared, nullptr);
  judge(result, prepared, predicted, std::log(scale));
  if (rivals) result.rivals = rival_errors(prepared);

  EvaluateOutcome out;
  out.views = {std::move(result)};
  out.summary = summarise(out.views);
  out.conventions = conventions_of(width, height, rivals);
  out.facts = {{"run", run.string()},
               {"view", view.string()},
               {"photograph", photograph_of(run, view_file(view.parent_path(), view.filename().string(), "im"))}};
  return out;
}

}  // namespace clerestory
