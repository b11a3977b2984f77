#include "experiments/studies/target_study.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/math/statistics.hpp"
#include "host/report/plot.hpp"
#include "host/report/progress.hpp"
#include "host/stopwatch.hpp"
#include "nets/render_until.hpp"

namespace clerestory {
namespace {

enum Stream : std::uint64_t { kTruth = kPhotographSeed + 1, kSeeds = 4 };

/// Of the truth's samples: a difference from one times that from the other holds no noise of either.
using Halves = std::array<Image, 2>;

/// A row: an error that is asked for, or a fixed number of samples.
struct Row {
  std::string who, label;
  double error = 0;
  int spp = 0;
};

class TargetStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  std::vector<Row> rows() const {
    std::vector<Row> all;
    for (const double error : config_.reals("target.errors"))
      all.push_back({fmt::format("error {:g}", error), fmt::format("--target-error {:g}", error), error, 0});
    for (const std::int64_t spp : config_.integers("target.spp"))
      all.push_back({fmt::format("spp {}", spp), fmt::format("--spp {}", spp), 0, static_cast<int>(spp)});
    return all;
  }

  void measure() override {
    settings_.light = study_light(config_.text("target.light")).light;
    use_light(settings_);
    settings_.points = config_.text("target.points");
    measure_rooms([this](const ListedRoom& listed) { return run_room(listed); });
  }

  RoomFindings run_room(const ListedRoom& listed) {
    const Random random(listed.seed);
    TracedRoom room = photographed(listed);
    RenderSettings settings = under_light(settings_, config_.text("target.light"), device_, room.scene);

    RenderSettings most = settings;
    most.points = "independent", most.sharing = Sharing::Never;  // nothing in common with the pictures that it judges
    most.spp = config_.whole("target.truth_spp") / 2;
    Halves truth;
    for (std::size_t k = 0; k < 2; ++k) {
      most.seed = random.seed(kTruth + k);
      truth[k] = render_scene(device_, room.scene, most).radiance;
    }
    settings.spp = 16;
    render_scene(device_, room.scene, settings);  // kernels are built
    const std::vector<bool> used = pixels_with_depth(room.scene);

    RoomFindings found;
    for (const Row& row : rows())
      for (std::int64_t s = 0; s < config_.integer("study.seeds"); ++s) {
        stop_if_interrupted("study");
        settings.seed = random.seed(kSeeds + static_cast<std::uint64_t>(s));
        measure_row(row, s, room.scene, settings, truth, used, found);
      }
    return found;
  }

  void measure_row(const Row& row, std::int64_t seed, const Scene& scene, RenderSettings settings, const Halves& truth,
                   const std::vector<bool>& used, RoomFindings& found) {
    const auto note = [&](const char* metric, double value) {
      found.add(Finding{metric, "picture", row.who}.of(seed), value);
    };
    const auto error_of = [&](const Image& picture) {
      return relmse_of_pair(picture, picture, truth[0], truth[1], used);
    };
    const Stopwatch watch;
    if (row.error > 0) {
      settings.spp = 16;
      const RenderedUntil reached = render_until(device_, scene, settings, {.error = row.error});
      note("seconds", watch.seconds()), note("spp", reached.rounds.back().spp);
      note("measured", std::pow(reached.error(), 2));
      note("relmse", error_of(reached.rendering.radiance));
    } else {
      settings.spp = row.spp;
      const Rendering rendering = render_scene(device_, scene, settings);
      note("seconds", watch.seconds()), note("spp", row.spp);
      note("relmse", error_of(rendering.radiance));
    }
  }

  /// Of each room over its seeds: squares of errors by their root mean, all else by its mean.
  std::vector<double> of_rooms(const Row& row, const char* metric, bool is_square) const {
    std::vector<double> rooms;
    for (const auto& seeds : found().present_by_seed({metric, "picture", row.who}, config_.integer("study.seeds")))
      rooms.push_back(is_square ? std::sqrt(std::max(mean(seeds), 0.0)) : mean(seeds));
    return rooms;
  }

  Table target_table() const {
    Table table;
    table.title = "An error asked for, and what comes of it";
    table.note = fmt::format(
        "{} rooms of {}, true maps, light = {}, {}, {} points, {}x{}: median over rooms; of each room over {} seeds "
        "errors by their root mean square, samples and seconds by their mean. Error: root relMSE (eps 0.01) over the "
        "pixels that have a depth, beside {} samples of the same layer in two halves, whose noise is not in it. "
        "Seconds: "
        "from nothing compiled to the picture, kernels built before",
        found().rooms(), rooms_.file.filename().string(), config_.text("target.light"), settings_.sampler,
        config_.text("target.points"), config_.integer("data.width"), config_.integer("data.height"),
        config_.integer("study.seeds"), config_.integer("target.truth_spp"));
    table.columns = {{"asked for"},
                     {"measured by itself", "root relMSE"},
                     {"true", "root relMSE"},
                     {"true / measured", "median"},
                     {"true / measured", "largest of a room"},
                     {"samples", "a pixel, median"},
                     {"samples", "least room"},
                     {"samples", "most"},
                     {"time", "s, median"}};
    for (const Row& row : rows()) {
      const std::vector<double> is = of_rooms(row, "relmse", true), said = of_rooms(row, "measured", true),
                                spp = of_rooms(row, "spp", false), seconds = of_rooms(row, "seconds", false);
      const auto number = [](double v) { return Cell(Measure{v}); };
      std::vector<Cell> cells{row.label, said.empty() ? Cell() : number(median(said)), number(median(is))};
      std::vector<double> ratios;
      for (std::size_t r = 0; r < said.size(); ++r) ratios.push_back(is[r] / said[r]);
      cells.push_back(ratios.empty() ? Cell() : number(median(ratios)));
      cells.push_back(ratios.empty() ? Cell() : number(*std::ranges::max_element(ratios)));
      cells.insert(cells.end(), {number(median(spp)), number(*std::ranges::min_element(spp)),
                                 number(*std::ranges::max_element(spp)), number(median(seconds))});
      table.add(std::move(cells));
    }
    return table;
  }

  void conclude() override {
    write_table("target", target_table());
    Plot plot;
    plot.title = "Error against time", plot.x_label = "seconds a view", plot.y_label = "root relMSE";
    plot.log_x = plot.log_y = true;
    Series asked{"an error asked for", {}, {}, {}, Stroke::LinePoints};
    Series fixed{"a number of samples", {}, {}, {}, Stroke::LinePoints};
    for (const Row& row : rows()) {
      Series& series = row.error > 0 ? asked : fixed;
      series.x.push_back(median(of_rooms(row, "seconds", false)));
      series.y.push_back(median(of_rooms(row, "relmse", true)));
    }
    plot.series = {asked, fixed};
    write_plot(run_.artifact("error_time.svg"), plot);
  }

  RenderSettings settings_;
};

}  // namespace

void add_target_keys(Schema& schema) {
  schema.section("target", "A re-render until its error is the one asked for.")
      .reals("target.errors", {0.05, 0.02, 0.01}, "Errors asked for: root relMSE", {1e-4, 10})
      .integers("target.spp", {16, 64, 256, 1024}, "Fixed numbers of samples a pixel beside them", {16, 65536})
      .integer("target.truth_spp", 16384, "Samples a pixel of the truth", {2, 1048576})
      .text("target.light", "image", "Who answers, a light of studies; +lamps with lamps fitted")
      .text("target.points", "sobol", "Random numbers of the layer", {"sobol", "independent"});
}

std::string run_target_study(const Config& config, const std::vector<std::string>& command) {
  return TargetStudy(config, command).run();
}

}  // namespace clerestory
