#include "experiments/studies/light_measures.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/applications/light_choice.hpp"
#include "experiments/evaluation/light_errors.hpp"
#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/trained_run.hpp"
#include "experiments/training/light_validation.hpp"
#include "experiments/truth/lit_room.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kRows = 64, kSamples = 64;           // rays of a view
constexpr std::uint64_t kRayKey = 0x61626c617465;  // the same rays for every training
constexpr std::int64_t kLeastPixels = 16;          // a view with fewer in a bin does not count there

void clamp_picture(Image& picture) {
  for (float& v : picture.data) v = std::clamp(v, 0.f, 1.f);
}

void add_cost_columns(Table& table) {
  table.columns.insert(
      table.columns.end(),
      {{"steps", "", Best::None, 4}, {"step", "s"}, {"in view", "s/M rays"}, {"out of view", "s/M rays"}});
}

void add_row(Table& table, std::vector<Cell> cells, const LightCosts& costs) {
  const auto part = [&](double RaySeconds::*seconds) {
    return costs.rays ? Cell(Measure{(*costs.rays).*seconds}) : Cell();
  };
  cells.insert(cells.end(),
               {Measure{costs.steps}, std::isfinite(costs.step_seconds) ? Cell(Measure{costs.step_seconds}) : Cell(),
                part(&RaySeconds::in_view), part(&RaySeconds::out_of_view)});
  table.add(std::move(cells));
}

/// The mean over views, or nothing.
Cell mean_cell(const std::vector<double>& values) {
  return values.empty() ? Cell() : Cell(Measure{mean(std::span<const double>(values))});
}

class Measuring {
 public:
  Measuring(const fs::path& run, const LightMeasuring& options, Device device)
      : run_(run), options_(options), device_(std::move(device)), loaded_(load_light(run / kLastWeights, device_)) {}

  RunTables tables() {
    costs_ = costs();
    judge();
    RunTables tables{{"light", light_table()}};
    for (const std::string& measure : options_.measures)
      tables[measure] = measure == "range" ? range_table() : rerender_table();
    return tables;
  }

 private:
  LightCosts costs() {
    const Leg& leg = loaded_.history.legs.back();
    LightCosts costs{static_cast<double>(leg.steps), step_seconds(leg), {}};
    if (!loaded_.net.li2020) costs.rays = light_ray_seconds(device_, loaded_.net);
    return costs;
  }

  void judge() {
    names_ = name_views({options_.test.string()}, "test");
    for (std::size_t i = 0; i < names_.size(); ++i) {
      LightView view = read_light_view(names_[i], options_.width, options_.height);
      if (options_.clamped) clamp_picture(view.image);
      const auto kept = std::make_shared<const LightView>(std::move(view));
      judged_.push_back({names_[i].text(), kept, draw_rays(*kept, kRows, kSamples, kProbeRows, kRayKey + i)});
    }
    predictor_ = std::make_unique<LightPredictor>(device_, loaded_.net, options_.width, options_.height, kRows,
                                                  kSamples, loaded_.states);
  }

  Table light_table() {
    const LightSummary s = judge_light(judged_, *predictor_);
    Table table;
    table.title = fmt::format("Incident light on {} views of unseen rooms", s.views);
    // Nets are trained with logarithms and relative errors; the first columns are of what they were not trained with.
    constexpr std::array lowest{kSmape, kRelMse, kLogRmse};
    table.columns = {{"rays"}, {kShownPsnr.name, kShownPsnr.unit, Best::Highest, kShownPsnr.digits}};
    for (const RadianceFigure& f : lowest) table.columns.push_back({f.name, f.unit, Best::Lowest, f.digits});
    table.columns.push_back({kMedianLog.name, kMedianLog.unit, Best::None, kMedianLog.digits});
    for (const RadianceFigure& f : {kShownPsnr, kSmape, kRelMse, kLogRmse})
      table.columns.push_back({"photograph", f.name, Best::None, f.digits});
    add_cost_columns(table);
    const auto cell = [](const RadianceError& e, const RadianceFigure& figure) {
      return e.views > 0 ? Cell(Measure{e.*figure.value}) : Cell();
    };
    for (const auto& [name, rays] :
         {std::pair{"hit", LightSummary::Hits}, {"miss", LightSummary::Misses}, {"all", LightSummary::All}}) {
      const RadianceError &net = s.of(rays, LightAnswerer::Full), &photo = s.of(rays, LightAnswerer::Photograph);
      add_row(table,
              {name, cell(net, kShownPsnr), cell(net, kSmape), cell(net, kRelMse), cell(net, kLogRmse),
               cell(net, kMedianLog), cell(photo, kShownPsnr), cell(photo, kSmape), cell(photo, kRelMse),
               cell(photo, kLogRmse)},
              costs_);
    }
    return table;
  }

  Table range_table() {
    std::vector<double> nets, truth, photo, off;
    for (const JudgedLight& v : judged_) {
      stop_if_interrupted("study");
      const LightAnswers answers = predictor_->answer(*v.view, v.rays);
      std::vector<float> planar(answers.full.size());
      for (std::size_t i = 0; i < v.rays.light.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) planar[c * v.rays.light.size() + i] = v.rays.light[i][c];
      const std::vector<double> alike(v.rays.light.size(), 1);
      const auto range = [&](const std::vector<float>& light) { return log_intensity_range(light, alike); };
      nets.push_back(range(answers.full)), truth.push_back(range(planar)), photo.push_back(range(answers.photograph));
      off.push_back(std::abs(nets.back() - truth.back()));
    }
    Table table;
    table.title = "Log-intensity range of a view's light: ln of 99th over 1st percentile of luminance, each + 0.01";
    table.columns = {{"range", "nets"}, {"truth"}, {"photograph"}, {"off by", "mean |nets - truth|", Best::Lowest, 3}};
    add_cost_columns(table);
    add_row(table, {mean_cell(nets), mean_cell(truth), mean_cell(photo), mean_cell(off)}, costs_);
    return table;
  }

  Table rerender_table() {
    RenderSettings settings;
    settings.light = light_of(loaded_.net), settings.spp = options_.spp;
    load_light_nets(settings, run_ / kLastWeights, device_);
    const std::vector<RoughnessBin>& bins = roughness_bins();
    std::vector<std::vector<double>> relmse(bins.size()), smape(bins.size()), psnr(bins.size());
    std::vector<double> seconds;
    for (const ViewName& name : names_) {
      stop_if_interrupted("study");
      Scene scene = scene_of(read_view(name.room, name.id), name.text());
      const Image truth = scene.photo;
      if (options_.clamped) clamp_picture(scene.photo);
      const Rendering again = render_scene(device_, scene, settings);
      seconds.push_back(again.seconds);
      const std::size_t n = truth.pixels();
      for (std::size_t b = 0; b < bins.size(); ++b) {
        std::vector<bool> used(n);
        for (std::size_t i = 0; i < n; ++i)
          used[i] =
              scene.depth.data[i] > 0 && scene.material.data[2 * n + i] == 0 && bins[b].holds(scene.material.data[i]);
        if (std::ranges::count(used, true) < kLeastPixels) continue;
        const RadianceError e = picture_error(again.radiance, truth, used);
        relmse[b].push_back(e.relmse), smape[b].push_back(e.smape), psnr[b].push_back(e.shown_psnr);
      }
    }
    Table table;
    table.title = fmt::format("Pictures rendered again with true maps, {} samples a pixel, by roughness", options_.spp);
    table.columns = {{"roughness"},
                     {kShownPsnr.name, kShownPsnr.unit, Best::Highest, 4},
                     {kSmape.name, kSmape.unit, Best::Lowest, 3},
                     {kRelMse.name, kRelMse.unit, Best::Lowest, 3},
                     {"views"},
                     {"time", "s a view"}};
    add_cost_columns(table);
    for (std::size_t b = 0; b < bins.size(); ++b)
      add_row(table,
              {bins[b].name, mean_cell(psnr[b]), mean_cell(smape[b]), mean_cell(relmse[b]),
               Measure{static_cast<double>(relmse[b].size())}, Measure{median(std::span<const double>(seconds))}},
              costs_);
    return table;
  }

  fs::path run_;
  const LightMeasuring& options_;
  Device device_;
  LoadedLight loaded_;
  LightCosts costs_;
  std::vector<ViewName> names_;
  std::vector<JudgedLight> judged_;
  std::unique_ptr<LightPredictor> predictor_;
};

}  // namespace

const std::vector<std::string>& light_measures() {
  static const std::vector<std::string> names{"range", "rerender"};
  return names;
}

RunTables measure_light(const fs::path& run, const LightMeasuring& options, Device device) {
  return Measuring(run, options, std::move(device)).tables();
}

const std::vector<RoughnessBin>& roughness_bins() {
  static const std::vector<RoughnessBin> bins{
      {"0 to 0.2", 0, 0.2}, {"0.2 to 0.5", 0.2, 0.5}, {"0.5 to 1", 0.5, 1}, {"all", 0, 1}};
  return bins;
}

}  // namespace clerestory
