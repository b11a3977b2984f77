#include "experiments/studies/room_differences.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "experiments/studies/trained_run.hpp"
#include "experiments/training/judged_views.hpp"
#include "experiments/weights/weights.hpp"
#include "host/math/bootstrap.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

using Texts = std::vector<std::string>;
/// An error of each room: the mean over its views that have one.
using ByRoom = std::map<std::string, double>;

constexpr std::uint64_t kSeed = 0x726f6f6d73;  // of the bootstrap's draws

/// What a finished training says of itself, and what the study has measured of it.
struct Trained {
  std::vector<JudgedErrorsList> lists;
  std::string kind;
};

Trained trained_of(const SweptRun& run) {
  Trained trained{read_judged_errors(run.folder / "artifacts/views.json"),
                  read_history(run.folder / kLastWeights).kind()};
  if (const auto measured = run.folder / kMeasuredErrors; std::filesystem::exists(measured))
    std::ranges::move(read_judged_errors(measured), std::back_inserter(trained.lists));
  return trained;
}

ByRoom by_room(const Trained& run, const std::string& list, std::size_t error) {
  std::map<std::string, std::vector<double>> views;
  for (const JudgedErrorsList& l : run.lists)
    for (const JudgedErrors& v : l.views)
      if (l.list == list && std::isfinite(v.errors.at(error))) views[v.room].push_back(v.errors[error]);
  ByRoom rooms;
  for (const auto& [room, errors] : views) rooms[room] = mean(errors);
  return rooms;
}

/// [seed][room] of each side, over the rooms that all of both have.
std::pair<Repeated, Repeated> paired(const std::vector<ByRoom>& mine, const std::vector<ByRoom>& other) {
  std::pair<Repeated, Repeated> sides{Repeated(mine.size()), Repeated(other.size())};
  for (const auto& [room, unused] : mine[0]) {
    const auto has = [&name = room](const ByRoom& rooms) { return rooms.contains(name); };
    if (!std::ranges::all_of(mine, has) || !std::ranges::all_of(other, has)) continue;
    for (std::size_t s = 0; s < mine.size(); ++s) sides.first[s].push_back(mine[s].at(room));
    for (std::size_t s = 0; s < other.size(); ++s) sides.second[s].push_back(other[s].at(room));
  }
  return sides;
}

std::vector<Cell> difference_cells(const Repeated& mine, const Repeated& first) {
  const Difference d = paired_bootstrap(mine, first, kSeed);
  const bool spread = mine.size() > 1 && first.size() > 1;
  const std::string verdict = !spread ? "one seed" : !d.clear() ? "none" : d.mean < 0 ? "better" : "worse";
  return {Measure{d.mean}, Measure{d.low}, Measure{d.high}, verdict};
}

class Comparison {
 public:
  explicit Comparison(const std::vector<SweptPoint>& points) : points_(points) {
    for (const SweptPoint& point : points) {
      std::vector<Trained>& all = trained_.emplace_back();
      for (const SweptRun* run : point.runs)
        if (run->failure.empty()) all.push_back(trained_of(*run));
    }
  }

  void fill(Table& table) const {
    for (std::size_t p = 0; p < points_.size(); ++p) {
      if (trained_[p].empty()) continue;
      const std::vector<ErrorName>& names = error_names(trained_[p][0].kind);
      for (const JudgedErrorsList& list : trained_[p][0].lists)
        for (std::size_t e = 0; e < names.size(); ++e) add_row(table, p, list.list, e, names[e]);
    }
  }

 private:
  void add_row(Table& table, std::size_t point, const std::string& list, std::size_t error,
               const ErrorName& name) const {
    const std::vector<ByRoom> mine = rooms_of(point, list, error), first = rooms_of(0, list, error);
    if (mine[0].empty()) return;  // of no view, as of photographs all but depth
    std::vector<double> means;
    for (const ByRoom& rooms : mine) {
      std::vector<double> errors;
      for (const auto& [room, e] : rooms) errors.push_back(e);
      if (!errors.empty()) means.push_back(mean(errors));
    }
    std::vector<Cell> row(points_[point].values.begin(), points_[point].values.end());
    row.insert(row.end(),
               {list, name.name + ", " + name.unit, Measure{static_cast<double>(mine[0].size())}, measure_of(means)});
    const auto [a, b] = first.empty() ? std::pair<Repeated, Repeated>() : paired(mine, first);
    const bool comparable = point > 0 && !a.empty() && a[0].size() > 1;
    const std::vector<Cell> cells = comparable ? difference_cells(a, b) : std::vector<Cell>(4);
    row.insert(row.end(), cells.begin(), cells.end());
    table.add(std::move(row));
  }

  std::vector<ByRoom> rooms_of(std::size_t point, const std::string& list, std::size_t error) const {
    std::vector<ByRoom> all;
    for (const Trained& run : trained_[point]) all.push_back(by_room(run, list, error));
    return all;
  }

  const std::vector<SweptPoint>& points_;
  std::vector<std::vector<Trained>> trained_;  // [point][run that is done]
};

}  // namespace

Table room_differences(const Texts& keys, const std::vector<SweptPoint>& points) {
  Table table;
  table.title = "Room by room against the first";
  table.note =
      "Errors of the last weights, mean over rooms ± deviation over seeds; difference to the first row's training on "
      "the same rooms, and the interval of 95 % of it: a bootstrap over rooms, which both share, and Welch's t over "
      "the seeds of each. Lower is better; none: the interval holds 0.";
  for (const std::string& key : keys) table.columns.push_back({key});
  const std::string to = points.empty() ? "" : fmt::format("to {}", fmt::join(points[0].values, " "));
  table.columns.insert(table.columns.end(), {{"list"},
                                             {"error"},
                                             {"rooms", "", Best::None, 4},
                                             {"mean", "", Best::None, 4},
                                             {"difference", to, Best::None, 3},
                                             {"from", "95 %"},
                                             {"up to", "95 %"},
                                             {"verdict"}});
  Comparison(points).fill(table);
  return table;
}

}  // namespace clerestory
