#include "experiments/studies/training_curves.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/studies/trained_run.hpp"
#include "experiments/training/judged_views.hpp"
#include "experiments/weights/weights.hpp"

namespace clerestory {
namespace {

constexpr const char *kList = "list", *kSeconds = "training", *kRatio = "ratio";

Cell number(double value) { return std::isfinite(value) ? Cell(Measure{value}) : Cell(); }

std::size_t column_of(const Table& table, const char* name) {
  const auto found = std::ranges::find(table.columns, name, &Column::name);
  return static_cast<std::size_t>(found - table.columns.begin());
}

std::string words_of(const std::vector<Cell>& row, std::size_t count) {
  std::string words;
  for (std::size_t c = 0; c < count; ++c)
    if (const auto* text = std::get_if<std::string>(&row[c])) words += (c > 0 ? " " : "") + *text;
  return words;
}

/// The series of that label, made where it is missing.
Series& series_of(Plot& plot, const std::string& label) {
  const auto found = std::ranges::find(plot.series, label, &Series::label);
  if (found != plot.series.end()) return *found;
  Series& series = plot.series.emplace_back();
  series.label = label, series.stroke = Stroke::LinePoints;
  return series;
}

Plot& plot_of(std::vector<Plot>& plots, const std::string& title) {
  const auto found = std::ranges::find(plots, title, &Plot::title);
  if (found != plots.end()) return *found;
  Plot& plot = plots.emplace_back();
  plot.title = title, plot.x_label = "seconds of training", plot.y_label = "ratio to the best trivial answers";
  return plot;
}

}  // namespace

Table training_curve(const std::filesystem::path& run) {
  const History history = read_history(run / kLastWeights);
  const Leg& leg = history.legs.back();
  const double before = history.hours() - leg.hours;
  Table table;
  table.title = "Error against training";
  table.note =
      "Ratio: geometric mean over errors of the ratio to the best trivial answer. Seconds are the device's: on a CPU "
      "processor time over its cores, and judging does not count.";
  table.columns = {{"at step"},
                   {kList},
                   {"steps", "", Best::None, 4},
                   {kSeconds, "s", Best::None, 4},
                   {kRatio, "to the best trivial answers"}};
  for (const ErrorName& name : error_names(leg.kind)) table.columns.push_back({name.name, name.unit, Best::None, 4});
  for (const HistoryPoint& p : leg.curve) {
    const std::string at = &p == &leg.curve.back() ? "end" : fmt::format("{}", p.step);
    const auto add = [&](const std::string& list, double score, const std::vector<double>& errors) {
      std::vector<Cell> row{at, list, Measure{static_cast<double>(p.step)}, Measure{3600 * (p.hours - before)},
                            number(score)};
      for (const double e : errors) row.push_back(number(e));
      table.add(std::move(row));
    };
    add(kValidationList, p.score, p.errors);
    for (const ListErrors& l : p.lists) add(l.list, l.score, l.errors);
  }
  return table;
}

std::vector<Plot> training_curve_plots(const Table& curves, std::size_t named) {
  const std::size_t list = column_of(curves, kList), seconds = column_of(curves, kSeconds),
                    ratio = column_of(curves, kRatio);
  std::vector<Plot> plots;
  for (const auto& row : curves.rows) {
    const auto* where = std::get_if<std::string>(&row[list]);
    const auto *x = std::get_if<Measure>(&row[seconds]), *y = std::get_if<Measure>(&row[ratio]);
    if (!where || !x || !y) continue;
    Series& series = series_of(plot_of(plots, "Rooms of " + *where), words_of(row, named));
    series.x.push_back(x->mean), series.y.push_back(y->mean), series.error.push_back(y->deviation);
  }
  return plots;
}

}  // namespace clerestory
