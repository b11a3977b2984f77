#include "experiments/studies/layer_study.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "experiments/studies/strip.hpp"
#include "experiments/studies/study_run.hpp"
#include "host/io/datasets.hpp"
#include "host/math/radiance.hpp"
#include "host/math/statistics.hpp"
#include "host/report/plot.hpp"
#include "host/report/progress.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct Method {
  std::string name, label;
  RenderSettings settings;
};

/// Error of one picture against the truth, over pixels of a kind.
struct Errors {
  double glossy = 0, rough = 0;  // relMSE, eps 0.01
};

/// relMSE over shaded pixels that do not emit; glossy: roughness below `limit`. A kind without pixels gives NaN.
Errors errors_of(const Scene& scene, const Image& picture, const Image& truth, double limit) {
  const std::size_t n = scene.photo.pixels();
  double sums[2] = {0, 0}, counts[2] = {0, 0};
  for (std::size_t i = 0; i < n; ++i) {
    if (scene.material.data[2 * n + i] > 0 || scene.depth.data[i] <= 0) continue;
    const int rough = scene.material.data[i] >= limit;
    for (std::size_t c = 0; c < 3; ++c) {
      sums[rough] += relative_square(picture.data[c * n + i], truth.data[c * n + i]), counts[rough] += 1;
    }
  }
  return {sums[0] / counts[0], sums[1] / counts[1]};
}

Series series(const std::string& label, Stroke stroke) {
  Series made;
  made.label = label, made.stroke = stroke;
  return made;
}

class LayerStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record a render; its step is the number of renders done.
  void measure() override {
    const std::vector<fs::path> views = make_views(view_options());
    for (const MetricRecord& r : records_) step_ = std::max(step_, r.step);
    const std::vector<Method> methods = this->methods();
    const std::int64_t seeds = config_.integer("study.seeds");
    Progress progress("study", static_cast<std::int64_t>(views.size() * methods.size()) * seeds, "renders", step_);
    for (std::size_t v = 0; v < views.size(); ++v) run_view(v, views[v], methods, progress);
  }

  std::vector<Method> methods() const {
    std::vector<Method> list;
    RenderSettings grid;
    grid.sampler = "grid8x16", grid.spp = 128;
    list.push_back({"grid", "grid 8x16, our BRDF", grid});
    grid.brdf = "li2020";
    list.push_back({"li2020", "grid 8x16, BRDF of Li et al.", grid});
    for (const std::int64_t spp : config_.integers("study.spp")) {
      RenderSettings ours;
      ours.spp = static_cast<int>(spp);
      list.push_back({fmt::format("ours{}", spp), fmt::format("Monte Carlo, {} samples", spp), ours});
    }
    list.push_back({"equal", "Monte Carlo, equal time to the grid", {}});
    return list;
  }

  Rendering render(const Scene& scene, RenderSettings settings, std::uint32_t seed) {
    settings.light = config_.text("study.light"), settings.thickness = config_.real("study.thickness");
    settings.seed = seed;
    stop_if_interrupted("study");
    return render_scene(device_, scene, settings);
  }

  /// The least of a few runs: noise of the machine only adds.
  double seconds_of(const Scene& scene, const RenderSettings& settings) {
    double best = 1e30;
    for (std::uint32_t i = 0; i < 3; ++i) best = std::min(best, render(scene, settings, i).seconds);
    return best;
  }

  void run_view(std::size_t v, const fs::path& view, const std::vector<Method>& methods, Progress& progress) {
    const std::int64_t seeds = config_.integer("study.seeds");
    const std::int64_t of_view = static_cast<std::int64_t>(methods.size()) * seeds,
                       first = static_cast<std::int64_t>(v) * of_view;
    if (step_ >= first + of_view) return;
    const Scene scene = scene_of(read_view(view), view.string());
    RenderSettings reference;
    reference.spp = static_cast<int>(config_.integer("study.truth_spp"));
    const Image truth = render(scene, reference, 0x7fffffff).radiance;
    RenderSettings ours;
    ours.spp = 64;
    const double per_sample = seconds_of(scene, ours) / 64, of_grid = seconds_of(scene, methods[0].settings);
    const int equal = std::max(2, static_cast<int>(std::lround(of_grid / per_sample)));

    std::vector<StripPicture> strip{{"photograph", scene.photo}, {"truth", truth}};  // then three methods
    for (std::size_t m = 0; m < methods.size(); ++m)
      for (std::int64_t s = 0; s < seeds; ++s) {
        const std::int64_t step = first + static_cast<std::int64_t>(m) * seeds + s + 1;
        if (step <= step_) continue;
        RenderSettings settings = methods[m].settings;
        if (methods[m].name == "equal") settings.spp = equal;
        const Rendering r = render(scene, settings, static_cast<std::uint32_t>(s + 1));
        const Errors e = errors_of(scene, r.radiance, truth, config_.real("study.glossy_below"));
        const std::string at = methods[m].name + "/";
        MetricRecord record{step,
                            0,
                            {{at + "glossy", e.glossy},
                             {at + "rough", e.rough},
                             {at + "seconds", r.seconds},
                             {at + "samples", static_cast<double>(settings.spp)}}};
        add_record(std::move(record));
        if (s == 0 && (methods[m].name == "grid" || methods[m].name == "li2020" || methods[m].name == "equal"))
          strip.push_back({methods[m].label, r.radiance});
        progress.advance();
      }
    if (v < 4 && strip.size() == 5) write_strip(run_.artifact(fmt::format("view{}.png", v)), strip);
  }

  /// Mean over views for each seed, then mean and deviation over seeds.
  Measure over_seeds(const std::string& key) const {
    const std::int64_t seeds = config_.integer("study.seeds");
    std::vector<double> per_seed;
    for (std::int64_t s = 0; s < seeds; ++s) {
      std::vector<double> of_views;
      for (const MetricRecord& r : records_)
        for (const auto& [name, value] : r.values)
          if (name == key && (r.step - 1) % seeds == s && std::isfinite(value)) of_views.push_back(value);
      if (!of_views.empty()) per_seed.push_back(mean(of_views));
    }
    return per_seed.empty() ? Measure{std::nan(""), 0, 0} : measure_of(per_seed);
  }

  void conclude() override {
    Table table;
    table.title = "Error against time";
    table.columns = {{"method", "", Best::None, 3},
                     {"samples", "a pixel", Best::None, 3},
                     {"glossy", "relMSE", Best::Lowest, 3},
                     {"rough", "relMSE", Best::Lowest, 3},
                     {"time", "s a view", Best::None, 3}};
    Plot plot;
    plot.title = "Error against time", plot.x_label = "seconds a view", plot.y_label = "relMSE",
    plot.log_x = plot.log_y = true;
    Series glossy = series("Monte Carlo, glossy", Stroke::LinePoints),
           rough = series("Monte Carlo, rough", Stroke::LinePoints);
    Series grid_glossy = series("grid, glossy", Stroke::Points), grid_rough = series("grid, rough", Stroke::Points);
    for (const Method& m : methods()) {
      const Measure g = over_seeds(m.name + "/glossy"), r = over_seeds(m.name + "/rough"),
                    t = over_seeds(m.name + "/seconds");
      table.add({m.label, over_seeds(m.name + "/samples"), g, r, t});
      const bool ours = m.name.rfind("ours", 0) == 0;
      if (!ours && m.name != "grid") continue;
      for (Series* s : {ours ? &glossy : &grid_glossy, ours ? &rough : &grid_rough}) {
        const Measure& e = s == &glossy || s == &grid_glossy ? g : r;
        s->x.push_back(t.mean), s->y.push_back(e.mean), s->error.push_back(e.deviation);
      }
    }
    plot.series = {glossy, rough, grid_glossy, grid_rough};
    write_plot(run_.artifact("error_time.svg"), plot);
    write_table("layer", table);
  }

  std::int64_t step_ = 0;
};

}  // namespace

void add_layer_keys(Schema& schema) {
  schema.integers("study.spp", {4, 16, 64, 256}, "Samples a pixel of the Monte Carlo rows", {2, 65536})
      .integer("study.truth_spp", 16384, "Samples a pixel of the truth", {2, 1048576})
      .real("study.glossy_below", 0.35, "Roughness below which a pixel counts as glossy", {0, 1})
      .text("study.light", "image", "Who answers for radiance", {"image", "constant", "panorama"});
}

std::string run_layer_study(const Config& config, const std::vector<std::string>& command) {
  return LayerStudy(config, command).run();
}

}  // namespace clerestory
