#include "experiments/evaluation/detection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {

double area_under_curve(const std::vector<double>& score, const std::vector<bool>& positive) {
  std::vector<std::size_t> order(score.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return score[a] < score[b]; });
  double below = 0, wins = 0;  // others that score less; pairs won, ties counting half
  for (std::size_t first = 0; first < order.size();) {
    double positives = 0, others = 0;
    std::size_t last = first;
    for (; last < order.size() && score[order[last]] == score[order[first]]; ++last)
      ++(positive[order[last]] ? positives : others);
    wins += positives * (below + others / 2), below += others;
    first = last;
  }
  const double positives = static_cast<double>(score.size()) - below;
  return below > 0 && positives > 0 ? wins / (below * positives) : std::numeric_limits<double>::quiet_NaN();
}

std::vector<ReliabilityBin> reliability_bins(const std::vector<double>& score, const std::vector<bool>& positive,
                                             int bins) {
  std::vector<ReliabilityBin> filled(static_cast<std::size_t>(bins));
  for (std::size_t i = 0; i < score.size(); ++i) {
    ReliabilityBin& bin = filled[static_cast<std::size_t>(std::clamp(static_cast<int>(score[i] * bins), 0, bins - 1))];
    ++bin.count, bin.positive += positive[i], bin.score += score[i];
  }
  return filled;
}

double calibration_error(const std::vector<ReliabilityBin>& bins) {
  double off = 0, count = 0;
  for (const ReliabilityBin& bin : bins) off += std::abs(bin.score - bin.positive), count += bin.count;
  return count > 0 ? off / count : std::numeric_limits<double>::quiet_NaN();
}

const char* PairedDifference::verdict() const {
  if (rooms < 2) return "one room";
  if (!(std::abs(mean) > 2 * spread)) return "none";
  return mean < 0 ? "lower" : "higher";
}

Measure over_rooms(const std::vector<std::vector<double>>& values) {
  std::vector<double> rooms, seeds;
  for (const std::vector<double>& room : values) {
    if (room.empty() || !std::ranges::all_of(room, [](double v) { return std::isfinite(v); })) continue;
    rooms.push_back(mean(room));
    seeds.resize(room.size(), 0);
    for (std::size_t s = 0; s < room.size(); ++s) seeds.at(s) += room[s];
  }
  if (rooms.empty()) throw Error(ErrorKind::Failed, "no room has such a value", "mean over rooms");
  const auto n = static_cast<double>(rooms.size());
  for (double& sum_of_rooms : seeds) sum_of_rooms /= n;
  return {mean(rooms), std::max(standard_deviation(seeds), standard_deviation(rooms) / std::sqrt(n)),
          static_cast<int>(rooms.size())};
}

PairedDifference paired_difference(const std::vector<std::vector<double>>& ours,
                                   const std::vector<std::vector<double>>& theirs) {
  std::vector<std::vector<double>> differences = ours;
  for (std::size_t r = 0; r < ours.size(); ++r)
    for (std::size_t s = 0; s < ours[r].size(); ++s) differences[r][s] -= theirs.at(r).at(s);
  const Measure all = over_rooms(differences);
  return {all.mean, all.deviation, all.count};
}

}  // namespace clerestory
