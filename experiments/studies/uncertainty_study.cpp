#include "experiments/studies/uncertainty_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "experiments/evaluation/detection.hpp"
#include "experiments/studies/room_study.hpp"
#include "experiments/studies/study_keys.hpp"
#include "experiments/training/light_validation.hpp"
#include "experiments/truth/lit_room.hpp"
#include "host/io/resize.hpp"
#include "host/math/statistics.hpp"
#include "host/report/plot.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr double kLeastCosine = 0.1;

/// Of rays of a kind, mixed by one constant of u.
Finding error_finding(const char* metric, const char* rays, std::int64_t constant) {
  return {metric, rays, fmt::format("constant {}", constant)};
}
/// Of the bins of u: "rays", of these "false", and the sum of their "u".
Finding bin_finding(const char* metric, std::int64_t constant, std::size_t bin) {
  return Finding{metric, "bins of u", fmt::format("constant {}", constant)}.of(static_cast<std::int64_t>(bin));
}
const Finding kHitShare{"share", "rays that hit"}, kFalseShare{"share", "false hits"}, kArea{"AUC", "false hits"};

class UncertaintyStudy : public RoomStudy {
 public:
  using RoomStudy::RoomStudy;

 private:
  void measure() override {
    options_ = lit_room_options(config_);
    RenderSettings settings;
    settings.light = "net";
    use_light_of_two_parts(settings);
    if (options_.predicted) options_.maps_weights = use_maps();
    const LightNets& nets = *settings.nets;
    const Size views{options_.width, options_.height};
    if (std::max(views.width, views.height) != nets.longer_side)
      throw usage_error("views of another size than the light's nets read", "data.width, data.height",
                        fmt::format("{}x{}", views.width, views.height),
                        fmt::format("{} along the longer side", nets.longer_side));
    LightPredictor predictor(device_, nets.sizes, views.width, views.height, options_.rows, options_.samples,
                             nets.states);
    measure_rooms([&](const ListedRoom& listed) {
      LitRoom room(device_, listed, options_);
      RoomFindings found;
      for (int v = 0; v < options_.views; ++v) {
        const KnownView known = room.view(v);
        for (std::size_t s = 0; s < known.draws.size(); ++s) {
          stop_if_interrupted("study");
          measure_draw(room, known, static_cast<std::int64_t>(s), predictor, found);
        }
      }
      return found;
    });
  }

  void measure_draw(LitRoom& room, const KnownView& known, std::int64_t seed, LightPredictor& predictor,
                    RoomFindings& found) {
    const LightRays& rays = known.draws[static_cast<std::size_t>(seed)];
    const LightAnswers answers = predictor.answer(known.view, rays);
    const std::vector<Vec3> met = room.first_surfaces(known, rays);
    std::vector<double> delta;
    std::vector<bool> is_false;
    KnownRays::Used all, hits;
    for (std::size_t i = 0; i < met.size(); ++i) {
      all.push_back(i);
      if (answers.pixel[i] < 0) continue;
      hits.push_back(i);
      delta.push_back(static_cast<double>(answers.delta[i]));
      is_false.push_back(!is_real_hit(known.view, answers.pixel[i], met[i], config_.real("uncertainty.footprints")));
    }
    if (hits.empty()) return;
    note_detection(seed, delta, is_false, found);
    found.add(kHitShare.of(seed), static_cast<double>(hits.size()) / static_cast<double>(all.size()));
    const KnownRays truth(rays.light);
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      const std::vector<float> mixed =
          mixed_light(answers.in_view, answers.out_of_view, answers.delta, answers.pixel, static_cast<double>(k));
      for (const auto& [kind, used] : {std::pair{"hits", &hits}, {"all", &all}}) {
        const RadianceError e = truth.error(mixed, *used);
        found.add(error_finding(kRelMse.key, kind, k).of(seed), e.relmse);
        found.add(error_finding(kLogRmse.key, kind, k).of(seed), e.log_rmse);
      }
    }
  }

  /// u grows with delta whatever the constant, and so does the area under the curve not change with it.
  void note_detection(std::int64_t seed, const std::vector<double>& delta, const std::vector<bool>& is_false,
                      RoomFindings& found) {
    found.add(kFalseShare.of(seed),
              static_cast<double>(std::ranges::count(is_false, true)) / static_cast<double>(is_false.size()));
    if (const double area = area_under_curve(delta, is_false); std::isfinite(area)) found.add(kArea.of(seed), area);
    const int bins = bin_count();
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      std::vector<double> u;
      for (const double d : delta) u.push_back(std::tanh(static_cast<double>(k) * d));
      const std::vector<ReliabilityBin> filled = reliability_bins(u, is_false, bins);
      for (std::size_t b = 0; b < filled.size(); ++b) {
        found.sum(bin_finding("rays", k, b), filled[b].count),
            found.sum(bin_finding("false", k, b), filled[b].positive);
        found.sum(bin_finding("u", k, b), filled[b].score);
      }
    }
  }

  int bin_count() const { return config_.whole("uncertainty.bins"); }

  // --- What the records say ---------------------------------------------------------------------------------------

  std::vector<double> seed_means(const Finding& finding) const {
    return found().seed_means(finding, config_.integer("study.seeds"));
  }
  /// Of all rooms and draws together.
  std::vector<ReliabilityBin> bins_of(std::int64_t constant) const {
    std::vector<ReliabilityBin> bins(static_cast<std::size_t>(bin_count()));
    for (std::size_t r = 0; r < found().rooms(); ++r)
      for (std::size_t b = 0; b < bins.size(); ++b) {
        const auto value = [&](const char* metric) {
          return found().value_or_nan(r, bin_finding(metric, constant, b));
        };
        if (!(value("rays") > 0)) continue;
        bins[b].count += value("rays"), bins[b].positive += value("false"), bins[b].score += value("u");
      }
    return bins;
  }

  std::string setting() const {
    return fmt::format("{} rooms x {} views, {} maps, {}", found().rooms(), config_.integer("incident.views"),
                       config_.text("data.maps"), incident_text(config_));
  }

  Table constants_table() const {
    Table table;
    table.title = fmt::format("The constant of u = tanh(constant delta), {}: mean over views, deviation over {} draws",
                              setting(), config_.integer("study.seeds"));
    table.columns = {{"constant", "", Best::None, 4},        {"relMSE, hits", "eps 0.01"},
                     {"relMSE, all rays", "eps 0.01"},       {"log-RGB RMSE, hits", "eps 0.01"},
                     {"log-RGB RMSE, all rays", "eps 0.01"}, {"u off the share of false hits", "mean over hits"}};
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      const auto errors = [&](const RadianceFigure& f, const char* rays) {
        return measure_or_nothing(seed_means(error_finding(f.key, rays, k)));
      };
      table.add({Measure{static_cast<double>(k)}, errors(kRelMse, "hits"), errors(kRelMse, "all"),
                 errors(kLogRmse, "hits"), errors(kLogRmse, "all"), Measure{calibration_error(bins_of(k))}});
    }
    return table;
  }

  Table detection_table() const {
    Table table;
    table.title = fmt::format(
        "u as a detector of false hits, {}: a hit is real when the first surface that the tracer meets lies within {} "
        "footprints of the pixel; mean over views, deviation over draws",
        setting(), config_.real("uncertainty.footprints"));
    table.columns = {{"rays that hit", "share"}, {"of these false", "share"}, {"AUC", "whatever the constant"}};
    table.add({measure_or_nothing(seed_means(kHitShare)), measure_or_nothing(seed_means(kFalseShare)),
               measure_or_nothing(seed_means(kArea))});
    return table;
  }

  void draw_reliability() const {
    Plot plot;
    plot.title = "Reliability of u", plot.x_label = "mean u of the bin", plot.y_label = "share of false hits";
    plot.x_range = plot.y_range = {0.0, 1.0};
    plot.series.push_back({"ideal", {0, 1}, {0, 1}, {}, Stroke::Dashed});
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      Series series{fmt::format("constant {}", k), {}, {}, {}, Stroke::LinePoints};
      for (const ReliabilityBin& bin : bins_of(k))
        if (bin.count > 0) series.x.push_back(bin.score / bin.count), series.y.push_back(bin.positive / bin.count);
      plot.series.push_back(series);
    }
    write_plot(run_.artifact("reliability.svg"), plot);
  }

  void conclude() override {
    write_table("1_detection", detection_table());
    std::fputs("\n", stdout);
    write_table("2_constants", constants_table());
    draw_reliability();
  }

  LitRoomOptions options_;
};

}  // namespace

bool is_real_hit(const LightView& view, int pixel, const Vec3& met, double footprints) {
  if (!std::isfinite(met.x)) return false;
  const int x = pixel % view.camera.width, y = pixel / view.camera.width;
  const double depth = static_cast<double>(view.true_depth.at(0, y, x));
  if (!(depth > 0)) return false;
  const Vec3 point = view.camera.unproject(x + 0.5, y + 0.5, depth),
             normal(view.true_normal.at(0, y, x), view.true_normal.at(1, y, x), view.true_normal.at(2, y, x));
  const double cosine = std::abs(glm::dot(glm::normalize(point), normal));
  const double side = depth / std::min(view.camera.fx, view.camera.fy) / std::max(cosine, kLeastCosine);
  return glm::distance(point, met) <= footprints * side;
}

std::vector<float> mixed_light(const std::vector<float>& in_view, const std::vector<float>& out_of_view,
                               const std::vector<float>& delta, const std::vector<int>& pixel, double constant) {
  std::vector<float> mixed(in_view.size());
  const std::size_t count = pixel.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double u = std::tanh(constant * static_cast<double>(delta[i]));
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = c * count + i;
      if (pixel[i] < 0)  // what is in view means nothing there
        mixed[at] = out_of_view[at];
      else
        mixed[at] =
            static_cast<float>((1 - u) * static_cast<double>(in_view[at]) + u * static_cast<double>(out_of_view[at]));
    }
  }
  return mixed;
}

void add_uncertainty_keys(Schema& schema) {
  schema.section("uncertainty", "u against the tracer's first surfaces.")
      .integers("uncertainty.constants", {1, 3, 10, 30, 100}, "Constants of u = tanh(constant delta)", {1, 100000})
      .real("uncertainty.footprints", 1.5, "A hit is real up to so many footprints of its pixel off", {0, 1000})
      .integer("uncertainty.bins", 10, "Bins of the reliability curve", {1, 1000});
}

std::string run_uncertainty_study(const Config& config, const std::vector<std::string>& command) {
  return UncertaintyStudy(config, command).run();
}

}  // namespace clerestory
