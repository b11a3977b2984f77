#include "experiments/studies/error_time_tables.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/studies/error_time_figures.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

// A bias is told by its square, whose z is above 0, or by the sum over pixels.
constexpr double kBiasedAt = 4, kBiasedBelow = 1e-3;
constexpr double kHeadline = 0.01;   // the error of which the seconds are told
constexpr std::size_t kColours = 6;  // of curves, before they repeat

constexpr auto kOfPictures =
    ". Error: relMSE (eps 0.01) over the pixels that have a depth. FLIP: mean over them of the difference that is seen "
    "when the picture and the truth, clamped to what a display shows, alternate at 67 pixels a degree. Seconds: of the "
    "layer";
constexpr auto kOfGradients =
    ". Error: squared distance from the true gradient over its square. Seconds: of forward and adjoint";
constexpr auto kOfBoth =
    ", kernels built before, median over seeds; ± over seeds. Front: nothing has less error in less time (of a "
    "gradient of that map). Bias: squared, free of noise, so that it falls below 0 by chance; z: how many of its "
    "standard "
    "errors "
    "it is from none. p: of Welch's test that the sum over pixels, in which biases of one sign add up, is that of the "
    "truth; where errors are mostly of rare bright samples, few seeds make it too small. Memory: the most on the "
    "device";
constexpr auto kOfStated =
    ". Stated: the mean square of the standard errors that the estimator states by its batches, over its variance";
constexpr auto kOfHeadline =
    "Seconds: on the straight line in logarithms between the two numbers of samples around it; < and >: it lies before "
    "the fewest or behind the most. Slopes of ln error, ± over seeds. Error: relMSE of pictures, of gradients squared "
    "distance from the true one over its square. z of the bias and p of the sum over pixels: over all numbers of "
    "samples; tag: biased where z is above 4 or p below 0.001. Rooms, truths and what is timed: in the tables of the "
    "parts";

constexpr auto kOfByPart =
    "Seconds: of the re-render with the light's nets, kernels built before, on the straight line in logarithms between "
    "the two numbers of samples around the error; < and >: it lies before the fewest or behind the most. With the "
    "maps' "
    "nets: and those that predict albedo, normals, depth and material of the photograph, which the rows do not use. "
    "Rooms, truths and what plain is: in the tables of the parts";

Cell number(double value) { return Measure{value}; }
Cell cell_of(const std::optional<double>& value) { return value ? number(*value) : Cell(); }

const char* error_unit(const ErrorTimePart& part) { return part.floor ? "relMSE" : "relative square"; }

/// How many standard errors all biases together are from none, those of each number of samples counting alike.
Cell z_of(const std::vector<double>& biases, const std::vector<double>& spreads) {
  double sum = 0;
  for (std::size_t k = 0; k < biases.size(); ++k) {
    if (!(spreads[k] > 0)) return {};
    sum += biases[k] / std::sqrt(spreads[k]);
  }
  return number(sum / std::sqrt(static_cast<double>(biases.size())));
}

/// What the two tests say: a bias beyond chance, or none seen, which is no proof. An unbiased estimator is called
/// biased about once in a thousand rows, more often where bright samples are rare.
Cell tag_of(const Cell& z, const std::optional<double>& p) {
  const auto* standard_errors = std::get_if<Measure>(&z);
  if (!standard_errors || !p) return {};
  return standard_errors->mean > kBiasedAt || *p < kBiasedBelow ? Cell("biased") : Cell("none seen");
}

/// Over rooms, one a seed. What is not a number stays one that shows.
std::vector<double> means_of_seeds(const Findings::BySeed& rooms) {
  std::vector<double> means(rooms.at(0).size());
  for (const std::vector<double>& room : rooms)
    for (std::size_t s = 0; s < means.size(); ++s) means[s] += room[s] / static_cast<double>(rooms.size());
  return means;
}

/// `of_rooms`(metric): its numbers, one a room.
template <class OfRooms>
std::vector<Shift> shifts_of(const OfRooms& of_rooms, std::int64_t seeds, int truth_runs) {
  const std::vector<double> value = of_rooms("shift"), spread = of_rooms("shift spread"),
                            truth = of_rooms("truth spread");
  std::vector<Shift> shifts;
  for (std::size_t r = 0; r < value.size(); ++r)
    shifts.push_back({value[r], {spread[r], truth[r]}, {seeds, truth_runs}});
  return shifts;
}

/// Whether some estimator tells its standard errors.
bool states_errors(const ErrorTimePart& part) {
  return std::ranges::any_of(part.estimators, [](const TimedEstimator& e) { return e.batches > 1; });
}

std::vector<Column> columns_of(const ErrorTimePart& part) {
  const bool picture = part.floor.has_value();
  std::vector<Column> columns{{"estimator", ""}};
  if (!picture) columns.push_back({"gradient", ""});
  columns.insert(columns.end(), {{"samples", "a pixel", Best::None, 4}, {"error", error_unit(part)}});
  if (picture) columns.insert(columns.end(), {{"SMAPE", "eps 0.01"}, {"FLIP", ""}});
  columns.insert(columns.end(), {{"time", "s"},
                                 {"efficiency", "1 / (error s)"},
                                 {"front", ""},
                                 {"variance", error_unit(part)},
                                 {"bias", error_unit(part), Best::None, 2},
                                 {"z", "of the bias", Best::None, 2},
                                 {"p", "of the sum", Best::None, 2},
                                 {"memory", "MiB"}});
  if (states_errors(part)) columns.push_back({"stated", "of the variance", Best::None, 2});
  return columns;
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string inside = text;
  for (std::size_t at = 0; (at = inside.find('"', at)) != std::string::npos; at += 2) inside.insert(at, "\"");
  return '"' + inside + '"';
}

}  // namespace

std::string region_of(const ErrorTimePart& part, const std::string& what) { return part.name + " " + what; }

Precision truth_precision(const ErrorTimePart& part, const Device& device) {
  return part.light != "net" && device.has_double() ? Precision::Double : Precision::Single;
}

/// What one estimator of one thing gives, by the number of samples.
struct ErrorTimeTables::Curve {
  std::vector<double> spp, seconds;
  std::vector<Measure> error, smape, flip;    // over seeds
  std::vector<std::vector<double>> of_seeds;  // error [seed]
  std::vector<double> bias, bias_spread, variance, memory;
  std::vector<std::optional<double>> stated;   // the mean square of standard errors that are stated, if they are
  std::vector<std::optional<double>> shift_p;  // that there is no shift

  std::vector<double> errors() const {
    std::vector<double> means;
    for (const Measure& e : error) means.push_back(e.mean);
    return means;
  }
  /// Of each seed's curve by itself; nothing where x hardly changes.
  Cell slope(const std::vector<double>& x) const {
    if (std::ranges::max(x) < 2 * std::ranges::min(x)) return {};
    std::vector<double> slopes;
    for (const std::vector<double>& y : of_seeds)
      if (const std::optional<double> slope = log_log_slope(x, y)) slopes.push_back(*slope);
    return measure_or_nothing(slopes);
  }
};

/// Of each room the median over seeds, then the mean over rooms.
std::vector<double> ErrorTimeTables::seconds(const ErrorTimePart& part, const TimedEstimator& estimator) const {
  std::vector<double> all;
  for (const std::int64_t spp : part.spp) {
    std::vector<double> rooms;
    const Finding finding{"seconds", part.name, estimator.name, std::to_string(spp)};
    for (const auto& seeds : found_.by_seed(finding, config_.integer("study.seeds"))) rooms.push_back(median(seeds));
    all.push_back(mean(rooms));
  }
  return all;
}

ErrorTimeTables::Curve ErrorTimeTables::curve(const ErrorTimePart& part, const std::string& what,
                                              const TimedEstimator& estimator) const {
  const std::int64_t seeds = config_.integer("study.seeds");
  Curve curve;
  curve.seconds = seconds(part, estimator), curve.of_seeds.resize(static_cast<std::size_t>(seeds));
  for (const std::int64_t spp : part.spp) {
    const auto named = [&](const char* metric, const std::string& region) {
      return Finding{metric, region, estimator.name, std::to_string(spp)};
    };
    const std::string region = region_of(part, what);
    const std::vector<double> errors = means_of_seeds(found_.by_seed(named("error", region), seeds));
    curve.spp.push_back(static_cast<double>(spp)), curve.error.push_back(measure_of(errors));
    for (std::size_t s = 0; s < errors.size(); ++s) curve.of_seeds[s].push_back(errors[s]);
    const auto over_seeds = [&](const char* metric) {
      return measure_of(means_of_seeds(found_.by_seed(named(metric, region), seeds)));
    };
    if (part.floor) curve.smape.push_back(over_seeds("smape")), curve.flip.push_back(over_seeds("flip"));
    const auto rooms = static_cast<double>(found_.rooms());
    const auto of_rooms = [&](const char* metric) { return found_.values(named(metric, region).of(0)); };
    curve.bias.push_back(mean(of_rooms("bias"))), curve.variance.push_back(mean(of_rooms("variance")));
    curve.bias_spread.push_back(sum(of_rooms("bias spread")) / (rooms * rooms));
    curve.shift_p.push_back(p_of_shifts(shifts_of(of_rooms, seeds, part.truth_runs)));
    curve.memory.push_back(std::ranges::max(found_.values(named("memory", part.name).of(0))));
    std::vector<double> stated;
    for (std::int64_t s = 0; s < seeds; ++s)
      for (const double square : found_.values(named("stated", region).of(s))) stated.push_back(square);
    curve.stated.push_back(stated.empty() ? std::nullopt : std::optional(mean(stated)));
  }
  return curve;
}

std::string ErrorTimeTables::sentence(const ErrorTimePart& part) const {
  return fmt::format(
      "{} room{} of {}, true maps, {}x{}, {} seeds; {}. Truth: {} samples a pixel, in {} runs of Sobol's "
      "points scrambled each by itself, in {} precision; their noise is not in the errors",
      found_.rooms(), found_.rooms() == 1 ? "" : "s",
      std::filesystem::path(config_.text("data.list")).filename().string(), config_.integer("data.width"),
      config_.integer("data.height"), config_.integer("study.seeds"), part.note, part.truth_spp, part.truth_runs,
      truth_precision(part, device_) == Precision::Double ? "double" : "single");
}

Table ErrorTimeTables::table_of(const ErrorTimePart& part) const {
  const bool picture = part.floor.has_value();
  Table table;
  table.title = part.title, table.columns = columns_of(part);
  table.note = sentence(part) + (picture ? kOfPictures : kOfGradients) + kOfBoth;
  if (states_errors(part)) table.note += kOfStated;
  for (const std::string& what : part.what) {
    std::vector<Curve> curves;
    std::vector<double> all_seconds, all_errors;
    for (const TimedEstimator& estimator : part.estimators) {
      curves.push_back(curve(part, what, estimator));
      const std::vector<double> errors = curves.back().errors();
      all_seconds.insert(all_seconds.end(), curves.back().seconds.begin(), curves.back().seconds.end());
      all_errors.insert(all_errors.end(), errors.begin(), errors.end());
    }
    const std::vector<bool> front = pareto_front(all_seconds, all_errors);
    for (std::size_t e = 0; e < curves.size(); ++e)
      for (std::size_t k = 0; k < part.spp.size(); ++k) {
        const Curve& c = curves[e];
        std::vector<Cell> row{part.estimators[e].name};
        if (!picture) row.emplace_back(what);
        row.insert(row.end(), {number(c.spp[k]), c.error[k]});
        if (picture) row.emplace_back(c.smape[k]), row.emplace_back(c.flip[k]);
        const double efficiency = 1 / (c.error[k].mean * c.seconds[k]);
        row.insert(row.end(),
                   {number(c.seconds[k]), efficiency > 0 ? number(efficiency) : Cell(),
                    front[e * part.spp.size() + k] ? Cell("front") : Cell(), number(c.variance[k]), number(c.bias[k]),
                    z_of({c.bias[k]}, {c.bias_spread[k]}), cell_of(c.shift_p[k]), number(c.memory[k])});
        if (states_errors(part)) row.push_back(c.stated[k] ? number(*c.stated[k] / c.variance[k]) : Cell());
        table.add(std::move(row));
      }
  }
  return table;
}

Table ErrorTimeTables::headline() const {
  Table table;
  table.title = fmt::format("Seconds to an error of {}, by estimator", kHeadline);
  table.note = kOfHeadline;
  table.columns = {{"light", ""},
                   {"of", ""},
                   {"estimator", ""},
                   {fmt::format("time to {}", kHeadline), "s"},
                   {"slope", "against seconds"},
                   {"slope", "against samples"},
                   {"error", "at the most samples"},
                   {"z", "of the bias", Best::None, 2},
                   {"p", "of the sum", Best::None, 2},
                   {"tag", ""}};
  for (const ErrorTimePart& part : parts_)
    for (const std::string& what : part.what)
      for (const TimedEstimator& estimator : part.estimators) {
        const Curve c = curve(part, what, estimator);
        table.add({part.light, what, estimator.name, seconds_to(kHeadline, c.seconds, c.errors()), c.slope(c.seconds),
                   c.slope(c.spp), c.error.back(), z_of(c.bias, c.bias_spread), cell_of(p_together(c.shift_p)),
                   tag_of(z_of(c.bias, c.bias_spread), p_together(c.shift_p))});
      }
  return table;
}

double ErrorTimeTables::maps_seconds() const {
  std::vector<double> rooms;
  for (const auto& seeds : found_.by_seed({"seconds", kMapsRegion}, config_.integer("study.seeds")))
    rooms.push_back(median(seeds));
  return mean(rooms);
}

Table ErrorTimeTables::by_part() const {
  Table table;
  table.title = fmt::format("Seconds to an error of {}, by part", kHeadline);
  table.note = kOfByPart;
  table.columns = {{"light", ""},
                   {"estimator", ""},
                   {fmt::format("re-render to {}", kHeadline), "s"},
                   {"plain's", "times this", Best::None, 2},
                   {"with the maps' nets", "s"},
                   {"plain's", "times this", Best::None, 2},
                   {"error", "at the most samples"}};
  const double maps = maps_seconds();
  for (const ErrorTimePart& part : parts_) {
    if (!part.against_plain) continue;
    std::vector<Cell> plain;
    for (const TimedEstimator& estimator : part.estimators) {
      const Curve c = curve(part, part.what[0], estimator);
      std::vector<double> whole = c.seconds;
      for (double& s : whole) s += maps;
      const std::vector<Cell> now{seconds_to(kHeadline, c.seconds, c.errors()),
                                  seconds_to(kHeadline, whole, c.errors())};
      if (plain.empty()) plain = now;
      table.add({part.light, estimator.name, now[0], factor_of(plain[0], now[0]), now[1], factor_of(plain[1], now[1]),
                 c.error.back()});
    }
  }
  return table;
}

std::map<std::string, Table> ErrorTimeTables::tables() const {
  std::map<std::string, Table> all{{"error_time", headline()}};
  if (std::ranges::any_of(parts_, &ErrorTimePart::against_plain)) all["by_part"] = by_part();
  for (const ErrorTimePart& part : parts_) all[part.name] = table_of(part);
  return all;
}

std::map<std::string, Plot> ErrorTimeTables::plots() const {
  std::map<std::string, Plot> all;
  for (const ErrorTimePart& part : parts_)
    for (const std::string& what : part.what) {
      Plot plot;
      plot.title = part.title + (part.what.size() > 1 ? ": " + what : "");
      plot.x_label = "seconds", plot.y_label = error_unit(part), plot.log_x = plot.log_y = true;
      plot.width = 960, plot.height = 600;
      for (const TimedEstimator& estimator : part.estimators) {
        const Curve c = curve(part, what, estimator);
        const Stroke stroke = plot.series.size() < kColours ? Stroke::LinePoints : Stroke::Dashed;
        plot.series.push_back({estimator.name, c.seconds, c.errors(), {}, stroke});
      }
      all[part.what.size() > 1 ? part.name + "_" + what : part.name] = plot;
    }
  return all;
}

std::string table_csv(const Table& table) {
  const auto spread = [&](std::size_t column) {
    return std::ranges::any_of(table.rows, [&](const auto& row) {
      const auto* measure = std::get_if<Measure>(&row[column]);
      return measure && measure->count > 1;
    });
  };
  std::string text;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const Column& column = table.columns[c];
    const std::string name = column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit);
    text += (c > 0 ? "," : "") + quoted(name) + (spread(c) ? "," + quoted("deviation of " + name) : "");
  }
  text += "\n";
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      const auto* words = std::get_if<std::string>(&row[c]);
      const auto* measure = std::get_if<Measure>(&row[c]);
      text += (c > 0 ? "," : "") + (words ? quoted(*words) : measure ? fmt::format("{:.9g}", measure->mean) : "");
      if (spread(c)) text += "," + (measure && measure->count > 1 ? fmt::format("{:.9g}", measure->deviation) : "");
    }
    text += "\n";
  }
  return text;
}

}  // namespace clerestory
