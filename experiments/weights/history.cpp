#include "experiments/weights/history.hpp"

#include <cmath>
#include <limits>
#include <map>

#include "host/error.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

using nlohmann::json;
constexpr std::int64_t kMostCounted = 1'000'000'000'000;  // views or steps of a leg: sums over legs stay whole numbers
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

json numbers(const std::vector<double>& values) {
  json out = json::array();
  for (const double v : values) out.push_back(std::isfinite(v) ? json(v) : json(nullptr));
  return out;
}

/// JSON knows no NaN: it is null there.
double number(const json& value) { return value.is_null() ? nan : value.get<double>(); }

std::vector<double> numbers(const json& values) {
  std::vector<double> out;
  for (const json& v : values) out.push_back(number(v));
  return out;
}

HistoryPoint point_of(const json& p, std::size_t errors, const std::string& where) {
  HistoryPoint point{whole_number<std::int64_t>(p.at("step"), "step", where),
                     p.at("hours"),
                     number(p.at("score")),
                     numbers(p.at("errors")),
                     numbers(p.at("ratios")),
                     number(p.at("scale_error"))};
  const auto check = [&](const auto& of) {
    if (of.errors.size() != errors || of.ratios.size() != errors)
      throw json::other_error::create(501, "a point of the curve has another number of errors", &p);
  };
  check(point);
  for (const json& l : p.value("lists", json::array())) {
    point.lists.push_back({l.at("list"), whole_number<std::int64_t>(l.at("views"), "views", where),
                           number(l.at("score")), numbers(l.at("errors")), numbers(l.at("ratios")),
                           number(l.at("scale_error"))});
    check(point.lists.back());
  }
  for (const json& f : p.value("frames", json::array()))
    point.frames.push_back({f.at("frame"), number(f.at("depth")), number(f.at("constant")), number(f.at("scale"))});
  return point;
}

json json_of(const HistoryPoint& p) {
  json point{{"step", p.step},
             {"hours", p.hours},
             {"score", p.score},
             {"errors", numbers(p.errors)},
             {"ratios", numbers(p.ratios)},
             {"scale_error", p.scale_error}};
  for (const ListErrors& l : p.lists)
    point["lists"].push_back({{"list", l.list},
                              {"views", l.views},
                              {"score", l.score},
                              {"errors", numbers(l.errors)},
                              {"ratios", numbers(l.ratios)},
                              {"scale_error", l.scale_error}});
  for (const FrameErrors& f : p.frames)
    point["frames"].push_back({{"frame", f.frame}, {"depth", f.depth}, {"constant", f.constant}, {"scale", f.scale}});
  return point;
}

std::string cell_of(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "-"; }

/// Errors of the last validation, against what a net without skill would get.
std::string result_table(const HistoryPoint& last, const std::string& kind) {
  std::string out = "| | error on validation | ratio to the best trivial predictor |\n|---|---|---|\n";
  const std::vector<ErrorName>& names = error_names(kind);
  for (std::size_t i = 0; i < names.size(); ++i)
    out += fmt::format("| {} | {} {} | {} |\n", names[i].name, cell_of(last.errors[i]), names[i].unit,
                       cell_of(last.ratios[i]));
  out += fmt::format("\nGeometric mean of the ratios {}", cell_of(last.score));
  if (kind == "maps")
    out += fmt::format("; scene scale: median |Δ ln| {}, a factor of {:.2f}", cell_of(last.scale_error),
                       std::exp(last.scale_error));
  return out + ".\n";
}

/// Error and ratio of each metric on every list, a column each.
std::string lists_table(const HistoryPoint& last, const std::string& kind) {
  std::string head = "|", rule = "|---", scores = "| score", scales = "| scale, median \\|Δ ln\\|";
  for (const ListErrors& l : last.lists) {
    head += fmt::format(" | {} ({} views)", l.list, l.views), rule += "|---";
    scores += fmt::format(" | {}", cell_of(l.score)), scales += fmt::format(" | {}", cell_of(l.scale_error));
  }
  std::string out = head + " |\n" + rule + "|\n";
  const std::vector<ErrorName>& names = error_names(kind);
  for (std::size_t i = 0; i < names.size(); ++i) {
    out += fmt::format("| {}, {}", names[i].name, names[i].unit);
    for (const ListErrors& l : last.lists) out += fmt::format(" | {} ({:.2f})", cell_of(l.errors[i]), l.ratios[i]);
    out += " |\n";
  }
  return out + (kind == "maps" ? scales + " |\n" : "") + scores + " |\n";
}

std::string frames_table(const std::vector<FrameErrors>& frames) {
  std::string out =
      "| photograph with measured depth | rooted si-log | ratio to its best constant | 99th percentile, predicted / "
      "measured |\n|---|---|---|---|\n";
  for (const FrameErrors& f : frames)
    out += fmt::format("| {} | {} | {:.2f} | {:.2f} |\n", f.frame, cell_of(f.depth), f.depth / f.constant, f.scale);
  return out;
}

/// Geometric mean of the frames' ratios to their best constants.
double frames_ratio(const std::vector<FrameErrors>& frames) {
  double logs = 0;
  for (const FrameErrors& f : frames) logs += std::log(f.depth / f.constant);
  return std::exp(logs / static_cast<double>(frames.size()));
}

std::string picture_line(const std::string& what, const std::string& plot) {
  return plot.empty() ? "" : fmt::format("\n![{}]({})\n", what, plot);
}

struct CardText {
  const char* title;
  std::string purpose;
  const char *conventions, *limits;
};

CardText card_text(const History& history) {
  if (history.kind() == "light")
    return {
        "Weights of the light",
        "The light that arrives at any point of a photographed room from any direction: LightNet and the net out of "
        "view, unless a leg names another net (light.net). Trained on generated rooms alone, by the legs below, from "
        "random weights or what `from` names.",
        "relMSE: mean over rays and channels of d² / (truth² + 0.01); log-RGB RMSE: root of the mean of ln((y + "
        "0.01) / (truth + 0.01))²; then means over views, under true maps unless the last leg says light.maps: then "
        "under MGNet's. Trivial predictors: the photograph (the pixel that a ray hits, mixed by the hit's uncertainty "
        "with the mean of pixels that do not emit) and the view's best constant.",
        "Trained on procedural rooms, under true maps unless a leg says light.maps. What lies outside of the picture "
        "is a guess at its colour and strength, without detail."};
  return {
      "Weights of the maps",
      fmt::format(
          "Maps of one photograph of a room: albedo, normals, depth, roughness and metallic. Trained on "
          "generated rooms {}, by the legs below; the first begins with random weights and, where `from` names "
          "it, an encoder that has learned on ImageNet.",
          saw_photographs(history) ? "and, where a leg names finetune.iiw or finetune.nyu, on photographs" : "alone"),
      "Conventions of these figures: `clerestory evaluate --weights FILE --data DIR` prints them all.",
      "Trained on procedural rooms: real photographs differ in texture, clutter and camera. Depth is relative; its "
      "scale in metres comes from one linear layer and is as rough as stated above. Mirrors, glass and text are "
      "read as surfaces."};
}

}  // namespace

bool saw_photographs(const History& history) {
  return std::ranges::any_of(history.legs, [](const Leg& leg) {
    return std::ranges::any_of(leg.overrides, [](const std::string& word) {
      return word.starts_with("finetune.iiw=") || word.starts_with("finetune.nyu=");
    });
  });
}

const std::vector<ErrorName>& error_names(const std::string& kind) {
  static const std::vector<ErrorName> maps = [] {
    std::vector<ErrorName> names;
    for (int i = 0; i < map_error_count; ++i) {
      const auto& metric = info(static_cast<MapError>(i));
      names.push_back({metric.key, metric.name, metric.unit});
    }
    return names;
  }();
  static const std::vector<ErrorName> light{{"hits_relmse", "rays that hit", "relMSE"},
                                            {"misses_relmse", "rays that miss", "relMSE"},
                                            {"all_relmse", "all rays", "relMSE"},
                                            {"hits_log", "rays that hit, log", "log-RGB RMSE"},
                                            {"misses_log", "rays that miss, log", "log-RGB RMSE"},
                                            {"all_log", "all rays, log", "log-RGB RMSE"}};
  return kind == "light" ? light : maps;
}

HistoryPoint history_point(const EvaluationSummary& summary) {
  HistoryPoint point;
  point.score = summary.score(), point.scale_error = summary.median_log_scale_error;
  for (int i = 0; i < map_error_count; ++i) {
    const MetricSummary* metric = summary.find(static_cast<MapError>(i));
    point.errors.push_back(metric ? metric->ours.mean : nan);
    point.ratios.push_back(metric ? metric->ratio : nan);
  }
  return point;
}

ListErrors list_errors(const std::string& list, std::int64_t views, const HistoryPoint& point) {
  return {list, views, point.score, point.errors, point.ratios, point.scale_error};
}

double History::hours() const {
  double total = 0;
  for (const Leg& leg : legs) total += leg.hours;
  return total;
}

std::int64_t History::views_seen() const {
  std::int64_t total = 0;
  for (const Leg& leg : legs) total += leg.views_seen;
  return total;
}

std::int64_t History::views_seen_before() const { return legs.empty() ? 0 : views_seen() - legs.back().views_seen; }

std::string history_json(const History& history) {
  json legs = json::array();
  for (const Leg& l : history.legs) {
    json curve = json::array();
    for (const HistoryPoint& p : l.curve) curve.push_back(json_of(p));
    legs.push_back({{"kind", l.kind},
                    {"experiment", l.experiment},
                    {"variant", l.variant},
                    {"config_hash", l.config_hash},
                    {"commit", l.commit},
                    {"started", l.started},
                    {"preset", l.preset},
                    {"width", l.width},
                    {"height", l.height},
                    {"batch", l.batch},
                    {"seed", l.seed},
                    {"rooms", l.rooms},
                    {"views", l.views},
                    {"steps", l.steps},
                    {"views_seen", l.views_seen},
                    {"hours", l.hours},
                    {"init", l.init},
                    {"overrides", l.overrides},
                    {"curve", curve}});
  }
  return json_text(legs, -1);
}

History history_from_json(const std::string& text, const std::string& where) {
  try {
    History history;
    for (const json& j : parse_json(text, where)) {
      const auto whole = [&]<class T>(T& to, const char* key) { to = whole_number<T>(j.at(key), key, where); };
      Leg l;
      l.kind = j.value("kind", "maps");
      l.experiment = j.at("experiment"), l.variant = j.at("variant"), l.config_hash = j.at("config_hash");
      l.commit = j.at("commit"), l.started = j.at("started"), l.preset = j.at("preset");
      whole(l.width, "width"), whole(l.height, "height"), whole(l.batch, "batch"), whole(l.seed, "seed");
      const auto counted = [&](std::int64_t& to, const char* key) {
        whole(to, key);
        if (to < 0 || to > kMostCounted)
          throw usage_error(fmt::format("wrong value of {}", key), where, fmt::format("{}", to),
                            fmt::format("0 to {}", kMostCounted));
      };
      counted(l.rooms, "rooms"), counted(l.views, "views"), counted(l.steps, "steps");
      counted(l.views_seen, "views_seen");
      l.hours = j.at("hours"), l.init = j.at("init"), l.overrides = j.at("overrides").get<std::vector<std::string>>();
      for (const json& p : j.at("curve")) l.curve.push_back(point_of(p, error_names(l.kind).size(), where));
      if (!history.legs.empty() && l.kind != history.kind())
        throw usage_error("the legs of a training are of two kinds", where, l.kind, history.kind());
      history.legs.push_back(std::move(l));
    }
    return history;
  } catch (const json::exception& e) {
    throw usage_error("the history of training cannot be read", where, e.what(), "what `clerestory train` wrote");
  }
}

Plot history_plot(const History& history) {
  Plot plot;
  plot.title = "Validation error over the best trivial predictor";
  plot.x_label = "hours of training", plot.y_label = "ratio (1: no skill)";
  const std::vector<ErrorName>& names = error_names(history.kind());
  for (int i = -1; i < static_cast<int>(names.size()); ++i) {
    Series series;
    series.label = i < 0 ? "geometric mean" : names[static_cast<std::size_t>(i)].name;
    series.stroke = i < 0 ? Stroke::LinePoints : Stroke::Line;
    for (const Leg& leg : history.legs)
      for (const HistoryPoint& p : leg.curve) {
        const double value = i < 0 ? p.score : p.ratios[static_cast<std::size_t>(i)];
        if (!std::isfinite(value)) continue;
        series.x.push_back(p.hours), series.y.push_back(value);
      }
    if (!series.x.empty()) plot.series.push_back(std::move(series));
  }
  // A net that knows nothing yet may be many times worse than a constant: the interesting part is below 2.
  double most = 0;
  for (const Series& s : plot.series)
    for (const double y : s.y) most = std::max(most, y);
  if (most > 2) plot.y_range = {{0, 2}};
  return plot;
}

Plot lists_plot(const History& history) {
  Plot plot;
  plot.title = "Geometric mean of the ratios to the best trivial predictors";
  plot.x_label = "hours of training", plot.y_label = "ratio (1: no skill)";
  std::map<std::string, Series> by_name;
  const auto add = [&](const std::string& name, double hours, double value) {
    if (!std::isfinite(value)) return;
    Series& series = by_name[name];
    series.label = name, series.stroke = Stroke::LinePoints;
    series.x.push_back(hours), series.y.push_back(value);
  };
  for (const Leg& leg : history.legs)
    for (const HistoryPoint& p : leg.curve) {
      for (const ListErrors& l : p.lists) add(l.list, p.hours, l.score);
      if (!p.frames.empty()) add("photographs (depth)", p.hours, frames_ratio(p.frames));
      if (!p.lists.empty() || !p.frames.empty()) add("validation", p.hours, p.score);
    }
  for (auto& [name, series] : by_name) plot.series.push_back(std::move(series));
  return plot;
}

std::string model_card(const History& history, const std::vector<std::pair<std::string, std::string>>& facts,
                       const CardPlots& plots) {
  const CardText text = card_text(history);
  std::string card = fmt::format("# {}\n\n{}\n\n| | |\n|---|---|\n", text.title, text.purpose);
  for (const auto& [name, value] : facts) card += fmt::format("| {} | {} |\n", name, value);
  card += fmt::format("| training | {:.2f} hours, {} views seen, {} leg{} |\n", history.hours(), history.views_seen(),
                      history.legs.size(), history.legs.size() == 1 ? "" : "s");
  if (!history.legs.empty() && !history.legs.back().curve.empty()) {
    const HistoryPoint& last = history.legs.back().curve.back();
    card += "\n## Validation\n" + result_table(last, history.kind()) +
            picture_line("validation error against hours", plots.validation) + fmt::format("\n{}\n", text.conventions);
    if (!last.lists.empty() || !last.frames.empty()) {
      card +=
          "\n## Fixed lists\nRooms kept as files, that no later generator changes; in brackets the ratio to the "
          "best trivial predictor.\n\n";
      if (!last.lists.empty()) card += lists_table(last, history.kind());
      if (!last.frames.empty()) card += "\n" + frames_table(last.frames);
      card += picture_line("scores of all lists against hours", plots.lists);
    }
  }
  card +=
      "\n## Legs\n| leg | started (UTC) | size | batch | rooms | views | steps | views seen | hours | seed | from | "
      "commit | settings |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  int number = 0;
  for (const Leg& l : history.legs)
    card += fmt::format("| {} | {} | {}x{} | {} | {} | {} | {} | {} | {:.2f} | {} | {} | {} | `{}` |\n", ++number,
                        l.started, l.width, l.height, l.batch, l.rooms, l.views, l.steps, l.views_seen, l.hours, l.seed,
                        l.init.empty() ? "random" : l.init, l.commit, fmt::join(l.overrides, " "));
  return card + fmt::format("\n## Limits\n{}\n", text.limits);
}

}  // namespace clerestory
