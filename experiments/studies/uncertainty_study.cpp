#include "experiments/studies/uncertainty_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "experiments/evaluation/detection.hpp"
#include "experiments/studies/study_run.hpp"
#include "experiments/training/light_validation.hpp"
#include "experiments/truth/lit_room.hpp"
#include "host/io/resize.hpp"
#include "host/math/statistics.hpp"
#include "host/report/plot.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

constexpr double kLeastCosine = 0.1;

class UncertaintyStudy : public StudyRun {
 public:
  using StudyRun::StudyRun;

 private:
  /// One record a room.
  void measure() override {
    options_ = lit_room_options(config_);
    RenderSettings settings;
    settings.light = "net";
    use_light(settings);
    if (options_.predicted) options_.maps_weights = use_maps();
    const LightNets& nets = *settings.nets;
    const Size views{options_.width, options_.height};
    if (std::max(views.width, views.height) != nets.longer_side)
      throw usage_error("views of another size than the light's nets read", "data.width, data.height",
                        fmt::format("{}x{}", views.width, views.height),
                        fmt::format("{} along the longer side", nets.longer_side));
    LightPredictor predictor(device_, nets.sizes, views.width, views.height, options_.rows, options_.samples,
                             nets.states, "auto");
    measure_rooms([&](const ListedRoom& listed) {
      LitRoom room(device_, listed, options_);
      values_.clear(), counts_.clear();
      for (int v = 0; v < options_.views; ++v) {
        const KnownView known = room.view(v);
        for (std::size_t s = 0; s < known.draws.size(); ++s) {
          stop_if_interrupted("study");
          measure_draw(room, known, s, predictor);
        }
      }
      MetricRecord record{listed.index + 1, 0, {}};
      for (const auto& [key, list] : values_) record.values.emplace_back(key, mean(list));
      for (const auto& [key, count] : counts_) record.values.emplace_back(key, count);
      add_record(std::move(record));
    });
  }

  void measure_draw(LitRoom& room, const KnownView& known, std::size_t seed, LightPredictor& predictor) {
    const LightRays& rays = known.draws[seed];
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
    note_detection(seed, delta, is_false);
    values_[fmt::format("rays that hit/{}", seed)].push_back(static_cast<double>(hits.size()) /
                                                             static_cast<double>(all.size()));
    const KnownRays truth(rays.light);
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      const std::vector<float> mixed =
          mixed_light(answers.in_view, answers.out_of_view, answers.delta, answers.pixel, static_cast<double>(k));
      for (const auto& [kind, used] : {std::pair{"hits", &hits}, {"all", &all}}) {
        const RadianceError e = truth.error(mixed, *used);
        values_[fmt::format("relMSE, {}/{} {}", kind, k, seed)].push_back(e.relmse);
        values_[fmt::format("log-RGB RMSE, {}/{} {}", kind, k, seed)].push_back(e.log_rmse);
      }
    }
  }

  /// u grows with delta whatever the constant, and so does the area under the curve not change with it.
  void note_detection(std::size_t seed, const std::vector<double>& delta, const std::vector<bool>& is_false) {
    values_[fmt::format("false hits/{}", seed)].push_back(static_cast<double>(std::ranges::count(is_false, true)) /
                                                          static_cast<double>(is_false.size()));
    if (const double area = area_under_curve(delta, is_false); std::isfinite(area))
      values_[fmt::format("AUC/{}", seed)].push_back(area);
    const int bins = bin_count();
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      std::vector<double> u;
      for (const double d : delta) u.push_back(std::tanh(static_cast<double>(k) * d));
      const std::vector<ReliabilityBin> filled = reliability_bins(u, is_false, bins);
      for (std::size_t b = 0; b < filled.size(); ++b) {
        counts_[bin_key(k, b, "rays")] += filled[b].count, counts_[bin_key(k, b, "false")] += filled[b].positive;
        counts_[bin_key(k, b, "u")] += filled[b].score;
      }
    }
  }

  int bin_count() const { return static_cast<int>(config_.integer("uncertainty.bins")); }
  static std::string bin_key(std::int64_t constant, std::size_t bin, const char* what) {
    return fmt::format("bins of u, constant {}/{} {}", constant, what, bin);
  }

  // --- What the records say ---------------------------------------------------------------------------------------

  double value(std::size_t room, const std::string& key) const {
    return value_of(room, key).value_or(std::numeric_limits<double>::quiet_NaN());
  }
  /// Means over rooms, one a seed; empty where no room has such a value.
  std::vector<double> seed_means(const std::string& begin) const {
    std::vector<double> means;
    for (std::int64_t s = 0; s < config_.integer("study.seeds"); ++s) {
      std::vector<double> rooms;
      for (std::size_t r = 0; r < records_.size(); ++r)
        if (const double v = value(r, begin + std::to_string(s)); std::isfinite(v)) rooms.push_back(v);
      if (!rooms.empty()) means.push_back(mean(rooms));
    }
    return means;
  }
  /// Of all rooms and draws together.
  std::vector<ReliabilityBin> bins_of(std::int64_t constant) const {
    std::vector<ReliabilityBin> bins(static_cast<std::size_t>(bin_count()));
    for (std::size_t r = 0; r < records_.size(); ++r)
      for (std::size_t b = 0; b < bins.size(); ++b) {
        const double count = value(r, bin_key(constant, b, "rays"));
        if (!(count > 0)) continue;
        bins[b].count += count, bins[b].positive += value(r, bin_key(constant, b, "false"));
        bins[b].score += value(r, bin_key(constant, b, "u"));
      }
    return bins;
  }

  std::string setting() const {
    return fmt::format("{} rooms x {} views, {} maps", records_.size(), config_.integer("incident.views"),
                       config_.text("data.maps"));
  }

  Table constants_table() const {
    Table table;
    table.title = fmt::format("The constant of u = tanh(constant delta), {}: mean over views, deviation over {} draws",
                              setting(), config_.integer("study.seeds"));
    table.columns = {{"constant", "", Best::None, 4},
                     {"relMSE, hits", "eps 0.01", Best::None, 3},
                     {"relMSE, all rays", "eps 0.01", Best::None, 3},
                     {"log-RGB RMSE, hits", "", Best::None, 3},
                     {"log-RGB RMSE, all rays", "", Best::None, 3},
                     {"u off the share of false hits", "mean over hits", Best::None, 3}};
    for (const std::int64_t k : config_.integers("uncertainty.constants")) {
      const auto errors = [&](const char* group) {
        return measure_or_nothing(seed_means(fmt::format("{}/{} ", group, k)));
      };
      table.add({Measure{static_cast<double>(k)}, errors("relMSE, hits"), errors("relMSE, all"),
                 errors("log-RGB RMSE, hits"), errors("log-RGB RMSE, all"), Measure{calibration_error(bins_of(k))}});
    }
    return table;
  }

  Table detection_table() const {
    Table table;
    table.title = fmt::format(
        "u as a detector of false hits, {}: a hit is real when the first surface that the tracer meets lies within {} "
        "footprints of the pixel; mean over views, deviation over draws",
        setting(), config_.real("uncertainty.footprints"));
    table.columns = {{"rays that hit", "share", Best::None, 3},
                     {"of these false", "share", Best::None, 3},
                     {"AUC", "whatever the constant", Best::None, 3}};
    table.add({measure_or_nothing(seed_means("rays that hit/")), measure_or_nothing(seed_means("false hits/")),
               measure_or_nothing(seed_means("AUC/"))});
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
  std::map<std::string, std::vector<double>> values_;  // of the room that is measured: one a view
  std::map<std::string, double> counts_;               // and what is summed over its views and draws
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

std::string run_uncertainty_study(const Config& config, const std::vector<std::string>& command) {
  return UncertaintyStudy(config, command).run();
}

}  // namespace clerestory
