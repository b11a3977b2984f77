#include "experiments/evaluation/summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/error.hpp"
#include "host/io/json_file.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr auto at(int i) { return static_cast<std::size_t>(i); }

/// A trivial predictor: its name and where a view's result holds it.
struct Trivial {
  const char* name;
  MapErrors ViewResult::*errors;
  Measure MetricSummary::*summary;
};
const std::array<Trivial, 3> trivials{{{"best constant", &ViewResult::constant, &MetricSummary::constant},
                                       {"training mean map", &ViewResult::mean_map, &MetricSummary::mean_map},
                                       {"the picture", &ViewResult::picture, &MetricSummary::picture}}};

Measure no_measure() { return {0, 0, 0}; }

/// Over the views that have an error of ours: `errors_of` a view's result.
template <class ErrorsOf>
Measure collect(const std::vector<ViewResult>& results, int metric, const ErrorsOf& errors_of) {
  std::vector<double> values;
  for (const ViewResult& r : results)
    if (const MapErrors& errors = errors_of(r); r.ours[at(metric)] && errors[at(metric)])
      values.push_back(*errors[at(metric)]);
  return values.empty() ? no_measure() : measure_of(values);
}
Measure collect(const std::vector<ViewResult>& results, MapErrors ViewResult::*errors, int metric) {
  return collect(results, metric, [errors](const ViewResult& r) -> const MapErrors& { return r.*errors; });
}

void summarise_rivals(const std::vector<ViewResult>& results, int metric, MetricSummary& m) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < rivals().size(); ++k) {
    m.rivals[k] = collect(results, metric, [k](const ViewResult& r) -> const MapErrors& { return r.rivals[k]; });
    if (m.rivals[k].count == m.views && m.rivals[k].mean < least) least = m.rivals[k].mean, m.best_rival = k;
  }
  m.rival_ratio = m.ours.mean / least;  // 0 where there is none
}

MetricSummary summarise_metric(const std::vector<ViewResult>& results, int metric) {
  MetricSummary m;
  m.error = static_cast<MapError>(metric);
  m.ours = collect(results, &ViewResult::ours, metric);
  m.views = m.ours.count;
  double least = std::numeric_limits<double>::infinity();
  for (const Trivial& t : trivials) {
    m.*(t.summary) = collect(results, t.errors, metric);
    // A predictor that answers only some views would be compared over others than ours.
    if ((m.*(t.summary)).count == m.views && (m.*(t.summary)).mean < least)
      least = (m.*(t.summary)).mean, m.best = t.name;
  }
  std::vector<double> strict;
  for (const ViewResult& r : results) {
    if (!r.ours[at(metric)]) continue;
    double smallest = std::numeric_limits<double>::infinity();
    for (const Trivial& t : trivials)
      if (const auto& e = (r.*(t.errors))[at(metric)]) smallest = std::min(smallest, *e);
    strict.push_back(smallest);
  }
  m.ratio = m.ours.mean / least;
  if (!strict.empty()) m.strict_ratio = m.ours.mean / mean(strict);
  summarise_rivals(results, metric, m);
  return m;
}

Cell cell(const Measure& m) { return m.count > 0 ? Cell(m) : Cell(); }

Cell number(double value) { return std::isfinite(value) ? Cell(Measure{value, 0, 1}) : Cell(); }

}  // namespace

ViewResult trivial_errors(const std::string& name, const PreparedView& view, const MapSet* means) {
  ViewResult result;
  result.view = name;
  result.constant = best_constant_errors(view.truth, view.masks);
  if (means) result.mean_map = map_errors(*means, view.truth, view.masks);
  Image clamped = view.image;  // as the net sees it
  for (float& v : clamped.data) v = std::clamp(v, 0.0f, 1.0f);
  result.picture[at(static_cast<int>(MapError::Albedo))] =
      scale_invariant_mse(clamped, view.truth.albedo, view.masks.albedo);
  return result;
}

void judge(ViewResult& result, const PreparedView& view, const MapSet& predicted, std::optional<double> log_scale) {
  result.ours = map_errors(predicted, view.truth, view.masks);
  result.log_scale_error.reset();
  if (log_scale && view.scene_scale > 0) result.log_scale_error = std::abs(*log_scale - std::log(view.scene_scale));
}

double EvaluationSummary::score() const {
  if (metrics.empty()) throw Error(ErrorKind::Failed, "no view has a valid pixel", "evaluation");
  double total = 0;
  int count = 0;
  for (const MetricSummary& m : metrics) {
    if (!std::isfinite(m.ours.mean)) return std::numeric_limits<double>::quiet_NaN();  // not a map without a figure
    if (std::isfinite(m.ratio)) total += std::log(std::max(m.ratio, 1e-6)), ++count;
  }
  return std::exp(total / count);
}

const MetricSummary* EvaluationSummary::find(MapError error) const {
  for (const MetricSummary& m : metrics)
    if (m.error == error) return &m;
  return nullptr;
}

EvaluationSummary summarise(const std::vector<ViewResult>& results) {
  EvaluationSummary summary;
  summary.views = static_cast<int>(results.size());
  for (int metric = 0; metric < map_error_count; ++metric)
    if (MetricSummary m = summarise_metric(results, metric); m.views > 0) summary.metrics.push_back(std::move(m));
  std::vector<double> scales;
  for (const ViewResult& r : results)
    if (r.log_scale_error) scales.push_back(*r.log_scale_error);
  summary.scale_views = static_cast<int>(scales.size());
  if (!scales.empty()) summary.median_log_scale_error = median(scales);
  return summary;
}

namespace {

/// Those that answer any map.
std::vector<std::size_t> rivals_of(const EvaluationSummary& summary) {
  std::vector<std::size_t> asked;
  for (std::size_t k = 0; k < rivals().size(); ++k)
    if (std::ranges::any_of(summary.metrics, [k](const MetricSummary& m) { return m.rivals[k].count > 0; }))
      asked.push_back(k);
  return asked;
}

}  // namespace

std::string rivals_text(const EvaluationSummary& summary) {
  std::vector<std::string> parts;
  for (const MetricSummary& m : summary.metrics)
    if (m.best_rival)
      parts.push_back(fmt::format("{}: {} {:.4g}, ours over it {:.3f}", info(m.error).name,
                                  rivals()[*m.best_rival].name, m.rivals[*m.best_rival].mean, m.rival_ratio));
  return parts.empty() ? "" : fmt::format("best simple rival: {}", fmt::join(parts, "; "));
}

Table summary_table(const EvaluationSummary& summary, const std::string& title) {
  Table table{title,
              {{"map", "", Best::None},
               {"ours", "", Best::None},
               {"best constant", "", Best::None},
               {"training mean", "", Best::None},
               {"the picture", "", Best::None},
               {"ratio", "to best", Best::None},
               {"strict ratio", "per view", Best::None},
               {"views", "", Best::None, 6}},
              {}};
  const std::vector<std::size_t> asked = rivals_of(summary);
  for (const std::size_t k : asked) table.columns.push_back({rivals()[k].name, "", Best::None});
  if (!asked.empty()) table.columns.push_back({"ratio", "to best rival", Best::None});
  for (const MetricSummary& m : summary.metrics) {
    std::vector<Cell> row{std::string(info(m.error).name) + ", " + info(m.error).unit,
                          cell(m.ours),
                          cell(m.constant),
                          cell(m.mean_map),
                          cell(m.picture),
                          number(m.ratio),
                          number(m.strict_ratio),
                          number(m.views)};
    for (const std::size_t k : asked) row.push_back(cell(m.rivals[k]));
    if (!asked.empty()) row.push_back(m.best_rival ? number(m.rival_ratio) : Cell());
    table.add(std::move(row));
  }
  return table;
}

std::vector<std::string> evaluation_conventions(int width, int height) {
  std::vector<std::string> lines{
      fmt::format("resolution {}x{}: picture and albedo averaged by area, all else nearest neighbour, nothing blurred",
                  width, height),
      "picture: linear Rec.709, scaled so that the 95th percentile of luminance is 0.9, clamped to [0, 1]; albedo "
      "linear, not sRGB",
      "masks: geometry = finite depth, normal and albedo; albedo = geometry that does not emit; material = geometry "
      "where roughness and metallic are not both 0",
      fmt::format("a view with less than {:.0f} % valid geometry is left out; every view counts the same",
                  100 * least_valid_share)};
  for (int i = 0; i < map_error_count; ++i)
    lines.push_back(
        fmt::format("{}: {}", info(static_cast<MapError>(i)).name, info(static_cast<MapError>(i)).convention));
  lines.push_back(
      "best constant: the constant that is best for each single view under that metric, found from its truth");
  lines.push_back(
      "training mean: per-pixel mean of maps that training began with (depth: of its logarithm), for every picture");
  lines.push_back("the picture: the linear clamped picture taken for the albedo, one scale per image");
  lines.push_back("ratio: mean of ours over views / mean of that trivial predictor over views whose mean is least");
  lines.push_back("strict ratio: the least trivial error is picked anew for every view");
  return lines;
}

FrameResult judge_frame(const std::string& name, const Image& predicted_depth, double log_scale, const Image& measured,
                        const MapSet* means) {
  const Image truth = resize_nearest(measured, predicted_depth.width, predicted_depth.height);
  Image mask(truth.width, truth.height, 1);
  const double metres = std::exp(log_scale) / scene_scale(predicted_depth.data, name);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < truth.data.size(); ++i)
    if (std::isfinite(truth.data[i]) && truth.data[i] > 0)
      mask.data[i] = 1, ratios.push_back(metres * predicted_depth.data[i] / truth.data[i]);
  FrameResult result{name, static_cast<double>(ratios.size()) / static_cast<double>(truth.data.size()), 0, 0, 0, 0, {}};
  const auto ours = rooted_si_log(predicted_depth, truth, mask);
  if (!ours) throw usage_error("no pixel has a measured depth", name);
  result.ours = *ours, result.metres = median(ratios);
  result.scale = std::exp(log_scale) / scene_scale(truth.data, name);
  result.constant = *rooted_si_log(Image(truth.width, truth.height, 1, 1.0f), truth, mask);
  if (means) result.mean_map = rooted_si_log(means->depth, truth, mask);
  return result;
}

Table frames_table(const std::vector<FrameResult>& frames) {
  Table table{"Depth on photographs with measured depth, rooted si-log",
              {{"frame", ""},
               {"measured", "% of pixels"},
               {"ours", ""},
               {"best constant", ""},
               {"training mean", ""},
               {"ours / constant", ""},
               {"ours / mean", ""},
               {"scale / measured", ""},
               {"metres / measured", ""}},
              {}};
  std::vector<double> to_constant, to_mean, off;
  for (const FrameResult& f : frames) {
    to_constant.push_back(f.ours / f.constant);
    if (f.mean_map) to_mean.push_back(f.ours / *f.mean_map);
    table.add({f.frame, number(100 * f.valid_share), number(f.ours), number(f.constant),
               f.mean_map ? number(*f.mean_map) : Cell(), number(to_constant.back()),
               f.mean_map ? number(to_mean.back()) : Cell(), number(f.scale), number(f.metres)});
    off.push_back(std::exp(std::abs(std::log(f.scale))));
  }
  if (frames.size() > 1) {
    const auto all = [&](auto member) {
      std::vector<double> values;
      for (const FrameResult& f : frames) values.push_back(f.*member);
      return measure_of(values);
    };
    table.add({"mean and spread", Cell(), all(&FrameResult::ours), all(&FrameResult::constant), Cell(),
               measure_of(to_constant), to_mean.empty() ? Cell() : Cell(measure_of(to_mean)), Cell(), Cell()});
    table.add({"median", Cell(), Cell(), Cell(), Cell(), number(median(to_constant)),
               to_mean.empty() ? Cell() : number(median(to_mean)),
               fmt::format("off by a factor of {:.2f}", median(off)), Cell()});
  }
  return table;
}

namespace {

using nlohmann::json;

json of(const Measure& m) {
  if (m.count == 0) return nullptr;
  return {{"mean", m.mean}, {"deviation", m.deviation}, {"count", m.count}};
}

json of(const MapErrors& errors) {
  json out = json::object();
  for (int i = 0; i < map_error_count; ++i)
    if (errors[at(i)]) out[info(static_cast<MapError>(i)).key] = *errors[at(i)];
  return out;
}

json of(const RivalErrors& errors) {
  json out = json::object();
  for (std::size_t k = 0; k < rivals().size(); ++k) out[rivals()[k].key] = of(errors[k]);
  return out;
}

}  // namespace

std::string evaluation_json(const EvaluationSummary& summary, const std::vector<ViewResult>& views,
                            const std::vector<FrameResult>& frames, const std::vector<std::string>& conventions,
                            const std::vector<std::pair<std::string, std::string>>& facts) {
  json out;
  for (const auto& [key, value] : facts) out["facts"][key] = value;
  out["conventions"] = conventions;
  for (const MetricSummary& m : summary.metrics)
    out["metrics"][info(m.error).key] = {{"ours", of(m.ours)},
                                         {"best_constant", of(m.constant)},
                                         {"training_mean", of(m.mean_map)},
                                         {"picture", of(m.picture)},
                                         {"best_trivial", m.best},
                                         {"ratio", m.ratio},
                                         {"strict_ratio", m.strict_ratio},
                                         {"views", m.views}};
  for (const MetricSummary& m : summary.metrics) {
    json& metric = out["metrics"][info(m.error).key];
    for (std::size_t k = 0; k < rivals().size(); ++k) metric["rivals"][rivals()[k].key] = of(m.rivals[k]);
    if (m.best_rival) metric["best_rival"] = rivals()[*m.best_rival].name, metric["rival_ratio"] = m.rival_ratio;
  }
  if (!summary.metrics.empty()) out["score"] = summary.score();
  if (summary.scale_views > 0)
    out["scene_scale"] = {{"median_abs_log_error", summary.median_log_scale_error}, {"views", summary.scale_views}};
  out["views"] = json::array();
  for (const ViewResult& v : views)
    out["views"].push_back({{"view", v.view},
                            {"ours", of(v.ours)},
                            {"best_constant", of(v.constant)},
                            {"training_mean", of(v.mean_map)},
                            {"picture", of(v.picture)},
                            {"rivals", of(v.rivals)}});
  out["frames"] = json::array();
  for (const FrameResult& f : frames)
    out["frames"].push_back({{"frame", f.frame},
                             {"ours", f.ours},
                             {"best_constant", f.constant},
                             {"scale_over_measured", f.scale},
                             {"metres_over_measured", f.metres},
                             {"training_mean", f.mean_map ? json(*f.mean_map) : json(nullptr)},
                             {"valid_share", f.valid_share}});
  return json_text(out) + "\n";  // names may be in any encoding
}

}  // namespace clerestory
