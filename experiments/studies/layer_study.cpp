#include "experiments/studies/layer_study.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "experiments/applications/light_choice.hpp"
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

/// Samples a pixel are the settings' own; at equal time, those that take as long as the grid.
struct Method {
  std::string name, label;
  RenderSettings settings;
  bool equal_time = false;
};

/// Error of one picture against the truth, over pixels of a kind.
struct Errors {
  std::optional<double> glossy, rough;  // relMSE, eps 0.01
};

/// relMSE over shaded pixels that do not emit; glossy: roughness below `limit`. A kind without pixels has none.
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
  const auto mean_of = [&](int kind) {
    return counts[kind] > 0 ? std::optional(sums[kind] / counts[kind]) : std::nullopt;
  };
  return {mean_of(0), mean_of(1)};
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
    ours_.light = config_.text("study.light"), ours_.thickness = config_.real("study.thickness");
    choose_sampler(ours_);
    use_light(ours_);
    const std::vector<fs::path> views = make_views(view_options());
    for (const MetricRecord& r : records_) step_ = std::max(step_, r.step);
    const std::vector<Method> methods = this->methods();
    const std::int64_t seeds = config_.integer("study.seeds");
    Progress progress("study", static_cast<std::int64_t>(views.size() * methods.size()) * seeds, "renders", step_);
    for (std::size_t v = 0; v < views.size(); ++v) run_view(v, views[v], methods, progress);
  }

  /// The estimator of `clerestory invert`, and that of Zhu et al. 2022: hemisphere visible normals, independent points.
  std::vector<Method> methods() const {
    std::vector<Method> list;
    RenderSettings grid = ours_, paper = ours_;
    grid.sampler = "grid8x16", grid.spp = 128;
    paper.sampler = "vndf_hemisphere", paper.points = "independent";
    list.push_back({"grid", "grid 8x16, our BRDF", grid});
    grid.brdf = "li2020";
    list.push_back({"li2020", "grid 8x16, BRDF of Li et al.", grid});
    for (const Method& who : {Method{"ours", "ours", ours_}, Method{"paper", "the paper's", paper}}) {
      for (const std::int64_t spp : config_.integers("study.spp")) {
        list.push_back(
            {fmt::format("{}{}", who.name, spp), fmt::format("{}, {} samples", who.label, spp), who.settings});
        list.back().settings.spp = static_cast<int>(spp);
      }
      list.push_back({who.name + "_equal", who.label + ", equal time to the grid", who.settings, true});
    }
    return list;
  }

  Rendering render(const Scene& scene, RenderSettings settings, std::uint32_t seed) {
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

  /// Samples that take as long as `seconds`, if time is a straight line through those of 64 and 128.
  int samples_in(double seconds, const Scene& scene, RenderSettings settings) {
    settings.spp = 64;
    const double of_64 = seconds_of(scene, settings);
    settings.spp = 128;
    const double of_128 = std::max(seconds_of(scene, settings), 1.01 * of_64);
    return std::max(2, static_cast<int>(std::lround(64 + 64 * (seconds - of_64) / (of_128 - of_64))));
  }

  void run_view(std::size_t v, const fs::path& view, std::vector<Method> methods, Progress& progress) {
    const std::int64_t seeds = config_.integer("study.seeds");
    const std::int64_t of_view = static_cast<std::int64_t>(methods.size()) * seeds,
                       first = static_cast<std::int64_t>(v) * of_view;
    if (step_ >= first + of_view) return;
    const Scene scene = scene_of(read_view(view), view.string());
    RenderSettings reference = ours_;
    reference.points = "independent", reference.sharing = Sharing::Never;  // nothing in common with what it judges
    reference.spp = config_.whole("study.truth_spp");
    const Image truth = render(scene, reference, 0x7fffffff).radiance;
    const double of_grid = seconds_of(scene, methods[0].settings);
    for (Method& m : methods)
      if (m.equal_time) m.settings.spp = samples_in(of_grid, scene, m.settings);

    std::vector<StripPicture> strip{{"photograph", scene.photo}, {"truth", truth}};  // then four methods
    for (std::size_t m = 0; m < methods.size(); ++m)
      for (std::int64_t s = 0; s < seeds; ++s) {
        const std::int64_t step = first + static_cast<std::int64_t>(m) * seeds + s + 1;
        if (step <= step_) continue;
        const Rendering r = render(scene, methods[m].settings, static_cast<std::uint32_t>(s + 1));
        const Errors e = errors_of(scene, r.radiance, truth, config_.real("study.glossy_below"));
        const std::string at = methods[m].name + "/";
        MetricRecord record{
            step, 0, {{at + "seconds", r.seconds}, {at + "samples", static_cast<double>(methods[m].settings.spp)}}};
        if (e.glossy) record.values.emplace_back(at + "glossy", *e.glossy);
        if (e.rough) record.values.emplace_back(at + "rough", *e.rough);
        add_record(std::move(record));
        if (s == 0 && (methods[m].name == "li2020" || methods[m].name == "grid" || methods[m].equal_time))
          strip.push_back({methods[m].label, r.radiance});
        progress.advance();
      }
    if (v < 4 && strip.size() == 6) write_strip(run_.artifact(fmt::format("view{}.png", v)), strip);
  }

  /// Of the views that have it.
  std::vector<double> of_views(const std::string& key, std::int64_t seed) const {
    std::vector<double> all;
    for (const MetricRecord& r : records_)
      for (const auto& [name, value] : r.values)
        if (name == key && (r.step - 1) % config_.integer("study.seeds") == seed) all.push_back(value);
    return all;
  }

  /// Mean over views for each seed, then mean and deviation over seeds.
  Measure over_seeds(const std::string& key) const {
    std::vector<double> per_seed;
    for (std::int64_t s = 0; s < config_.integer("study.seeds"); ++s)
      if (const std::vector<double> all = of_views(key, s); !all.empty()) per_seed.push_back(mean(all));
    return per_seed.empty() ? Measure{std::nan(""), 0, 0} : measure_of(per_seed);
  }

  void conclude() override {
    Table table;
    table.title = "Error against time";
    table.note = fmt::format(
        "{} rooms of one view, true maps, {}x{}, light = {}, {} seeds. Ours: {}, {} points; the paper's: hemisphere "
        "visible normals, independent points. Glossy: roughness below {}; error: mean over views of relMSE (eps 0.01) "
        "over pixels that do not emit, beside {} samples of the same light, whose noise is in it. Samples: mean over "
        "views, and the fewest of one, whose error weighs most. Times ours: glossy error over that of ours at equal "
        "time",
        config_.integer("data.rooms"), config_.integer("data.width"), config_.integer("data.height"), ours_.light,
        config_.integer("study.seeds"), ours_.sampler, ours_.points, config_.real("study.glossy_below"),
        config_.integer("study.truth_spp"));
    table.columns = {{"method"},
                     {"samples", "a pixel"},
                     {"glossy", "relMSE", Best::Lowest, 3},
                     {"rough", "relMSE", Best::Lowest, 3},
                     {"time", "s a view"},
                     {"times ours", "glossy"},
                     {"samples", "fewest of a view", Best::None, 4}};
    const double ours_at_equal_time = over_seeds("ours_equal/glossy").mean;
    for (const Method& m : methods()) {
      const Measure g = over_seeds(m.name + "/glossy");
      const bool as_long = m.equal_time || m.name == "grid" || m.name == "li2020";
      table.add({m.label, over_seeds(m.name + "/samples"), g, over_seeds(m.name + "/rough"),
                 over_seeds(m.name + "/seconds"), as_long ? Cell(Measure{g.mean / ours_at_equal_time}) : Cell(),
                 Measure{std::ranges::min(of_views(m.name + "/samples", 0))}});
    }
    write_table("layer", table);
    draw();
  }

  void draw() const {
    Plot plot;
    plot.title = "Error against time", plot.x_label = "seconds a view", plot.y_label = "relMSE",
    plot.log_x = plot.log_y = true;
    for (const char* kind : {"glossy", "rough"})
      for (const char* who : {"ours", "paper", "grid"}) {
        Series s =
            series(fmt::format("{}, {}", who, kind), who == std::string("grid") ? Stroke::Points : Stroke::LinePoints);
        for (const Method& m : methods()) {
          if (m.equal_time || m.name.rfind(who, 0) != 0) continue;
          const Measure e = over_seeds(m.name + "/" + kind);
          s.x.push_back(over_seeds(m.name + "/seconds").mean), s.y.push_back(e.mean), s.error.push_back(e.deviation);
        }
        plot.series.push_back(std::move(s));
      }
    write_plot(run_.artifact("error_time.svg"), plot);
  }

  RenderSettings ours_;
  std::int64_t step_ = 0;
};

}  // namespace

void add_layer_keys(Schema& schema) {
  schema.integers("study.spp", {4, 16, 64, 256}, "Samples a pixel of the Monte Carlo rows", {2, 65536})
      .integer("study.truth_spp", 16384, "Samples a pixel of the truth", {2, 1048576})
      .real("study.glossy_below", 0.35, "Roughness below which a pixel counts as glossy", {0, 1})
      .text("study.light", "image", "Who answers for radiance", {"image", "constant", "panorama", "net"});
}

std::string run_layer_study(const Config& config, const std::vector<std::string>& command) {
  return LayerStudy(config, command).run();
}

}  // namespace clerestory
