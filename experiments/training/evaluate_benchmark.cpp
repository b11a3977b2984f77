#include "experiments/training/evaluate_benchmark.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/training/validation.hpp"
#include "experiments/weights/map_predictor.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

Benchmark benchmark_of(const BenchmarkOptions& options) {
  const Protocol protocol = protocol_of(options.protocol);
  switch (layout_of(options.data)) {
    case DataLayout::Iiw:
      return iiw_benchmark(protocol, options.data, options.list);
    case DataLayout::Nyu:
      return nyu_benchmark(protocol, options.data, options.list);
    case DataLayout::OpenRooms:
      return openrooms_benchmark(protocol, options.data, options.list);
    case DataLayout::Rooms:
      break;
  }
  if (!options.list.file.empty())
    throw usage_error("rooms have lists of their own", "--list", options.list.file.string(), "--split NAME");
  std::string split = options.list.split;
  std::vector<fs::path> views;
  for (const ViewName& name : views_to_judge(options.data, split)) views.push_back(name.room / name.id);
  Benchmark benchmark = rooms_benchmark(protocol, views);
  benchmark.conventions.insert(benchmark.conventions.begin(), "views: " + split);
  return benchmark;
}

using Predict = std::function<PredictedMaps(std::size_t)>;

/// From the folder of another method.
Predict given_maps(const fs::path& maps, AlbedoCode code, const std::vector<std::string>& names) {
  return [maps, code, names, first = PredictedMaps{}](std::size_t i) mutable {
    PredictedMaps read = read_predicted(maps, names[i], code);
    if (i == 0) first = read;
    check_same_kinds(read, first, names[i]);
    return read;
  };
}

/// By weights, one picture at a time: those of photographs differ in size.
Predict predicted_by(const BenchmarkOptions& options, const Benchmark& benchmark, BenchmarkResult& told) {
  Device device = Device::open(options.device);
  device.use_tile(options.tile), device.use_gemm(options.gemm);
  const LoadedWeights weights = load_weights(options.weights, device);
  const int longer = std::max(weights.size.width, weights.size.height);
  told.facts = {{"weights", options.weights.string()},
                {"weights hash", file_hash(options.weights)},
                {"net", weights.preset + ": " + net_text(weights.net)},
                {"device", device.info().name}};
  told.conventions = {fmt::format(
      "predicted from the picture at {} pixels of its longer side, averaged by area, linear, scaled so that the 95th "
      "percentile of luminance is 0.9, clamped to [0, 1], once as it is and once mirrored; maps are the mean of both "
      "and stay at that size until the protocol resizes them",
      longer)};
  const auto predictor = std::make_shared<MapPredictor>(device, weights.net, weights.states, 1);
  return [predictor, longer, picture = benchmark.picture](std::size_t i) {
    const Image small = prepare_photo(picture(i), longer);
    MapSet maps = predictor->predict({&small}).front().maps;
    return PredictedMaps{std::move(maps.albedo), std::move(maps.normal), std::move(maps.depth),
                         std::move(maps.material)};
  };
}

Predict with_progress(Predict predict, std::size_t pictures) {
  const auto bar = std::make_shared<Progress>("evaluate", static_cast<std::int64_t>(pictures), "pictures");
  return [bar, predict = std::move(predict)](std::size_t i) {
    stop_if_interrupted("evaluate");
    PredictedMaps maps = predict(i);
    bar->advance();
    return maps;
  };
}

}  // namespace

BenchmarkResult evaluate_benchmark(const BenchmarkOptions& options) {
  catch_interrupts();
  const Benchmark benchmark = benchmark_of(options);
  BenchmarkResult told;
  Predict predict;
  if (options.method) {
    predict = [&](std::size_t i) { return options.method(benchmark.picture(i)); };
  } else if (options.maps.empty()) {
    predict = predicted_by(options, benchmark, told);
  } else {
    predict = given_maps(options.maps, options.albedo, benchmark.names);
    told.facts = {{"maps", options.maps.string()}};
    told.conventions = {options.albedo == AlbedoCode::Srgb ? "albedo of the maps: display values, v^2.2 is linear"
                                                           : "albedo of the maps: linear",
                        "depth of the maps: over its maximum, whatever its unit"};
  }
  BenchmarkResult result = run_benchmark(benchmark, with_progress(std::move(predict), benchmark.names.size()));
  result.facts.insert(result.facts.begin(), told.facts.begin(), told.facts.end());
  result.facts.emplace_back("data", options.data.string());
  result.conventions.insert(result.conventions.begin(), told.conventions.begin(), told.conventions.end());
  return result;
}

namespace {

/// What is not there is replaced by the truth, so that the others can be judged, and has no figure afterwards.
ViewResult judge_given(const std::string& name, const PredictedMaps& maps, const fs::path& view, bool rivals) {
  const Image& first = maps.albedo   ? *maps.albedo
                       : maps.normal ? *maps.normal
                       : maps.depth  ? *maps.depth
                                     : *maps.material;
  const int width = first.width, height = first.height;
  const PreparedView prepared = prepare_view(read_view(view), width, height);
  MapSet predicted = prepared.truth;
  const auto take = [&](const std::optional<Image>& map, Image& to, const char* kind) {
    if (!map) return;
    if (map->width != width || map->height != height)
      throw usage_error("the maps of a view have unlike sizes", name,
                        fmt::format("{} of {}x{}", kind, map->width, map->height), fmt::format("{}x{}", width, height));
    std::copy_n(map->data.begin(), to.data.size(), to.data.begin());  // of the material two channels
  };
  take(maps.albedo, predicted.albedo, "albedo"), take(maps.normal, predicted.normal, "normal");
  take(maps.depth, predicted.depth, "depth"), take(maps.material, predicted.material, "material");
  if (maps.depth) {
    const double unit = scene_scale(predicted.depth.data, name);
    for (float& d : predicted.depth.data) d /= static_cast<float>(unit);
  }
  ViewResult result = trivial_errors(name, prepared, nullptr);
  judge(result, prepared, predicted, std::nullopt);
  if (rivals) result.rivals = rival_errors(prepared);
  const auto forget = [&](bool there, MapError error) {
    if (!there) result.ours[static_cast<std::size_t>(error)].reset();
  };
  forget(maps.normal.has_value(), MapError::Normal), forget(maps.depth.has_value(), MapError::Depth);
  forget(maps.albedo.has_value(), MapError::Albedo), forget(maps.material.has_value(), MapError::Roughness);
  forget(maps.material.has_value(), MapError::Metallic);
  return result;
}

}  // namespace

EvaluateOutcome evaluate_maps(const fs::path& maps, AlbedoCode albedo, const EvaluateOptions& options) {
  catch_interrupts();
  if (layout_of(options.data) != DataLayout::Rooms)
    throw usage_error("holds no rooms", options.data.string(), {}, "rooms, or --protocol zhu or li");
  std::string split = options.split;
  const std::vector<ViewName> views = views_to_judge(options.data, split);
  std::vector<std::string> names;
  for (const ViewName& view : views) names.push_back(view.room.filename().string() + "/" + view.id);
  const Predict predict = with_progress(given_maps(maps, albedo, names), names.size());
  EvaluateOutcome out;
  Size size;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const PredictedMaps read = predict(i);
    out.views.push_back(judge_given(names[i], read, views[i].room / views[i].id, options.rivals));
    const Image& any = read.albedo   ? *read.albedo
                       : read.normal ? *read.normal
                       : read.depth  ? *read.depth
                                     : *read.material;
    size = {any.width, any.height};
  }
  out.summary = summarise(out.views);
  out.conventions = evaluation_conventions(size.width, size.height);
  if (options.rivals) std::ranges::copy(rival_conventions(), std::back_inserter(out.conventions));
  out.conventions.push_back(albedo == AlbedoCode::Srgb ? "albedo of the maps: display values, v^2.2 is linear"
                                                       : "albedo of the maps: linear");
  out.facts = {{"maps", maps.string()},
               {"data", fmt::format("{} ({}): {} views", options.data.string(), split, views.size())}};
  return out;
}

}  // namespace clerestory
