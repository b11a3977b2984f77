// How well a score between 0 and 1 tells two kinds apart, whether it is the share it claims to be, and whether a
// difference is more than chance.
#pragma once
#include <vector>

#include "host/report/table.hpp"

namespace clerestory {

/// Area under the receiver's operating characteristic: the chance that one of the `positive` scores higher than one of
/// the others, ties counting half (Mann and Whitney 1947). NaN where there is only one kind.
double area_under_curve(const std::vector<double>& score, const std::vector<bool>& positive);

/// What falls into each of equally wide bins of the score.
struct ReliabilityBin {
  double count = 0, positive = 0, score = 0;  // how many; of them positive; sum of their scores
};
/// Scores are in [0, 1]; 1 is in the last bin.
std::vector<ReliabilityBin> reliability_bins(const std::vector<double>& score, const std::vector<bool>& positive,
                                             int bins);
/// Mean over all scores of |mean score - share of positives| of their bin. NaN without any.
double calibration_error(const std::vector<ReliabilityBin>& bins);

/// The one rule of studies for a figure and its spread. Values [room][seed]; rooms with one that is not finite are left
/// out. Mean over rooms and seeds; deviation: the larger of the standard deviation over seeds of the mean over rooms
/// and the standard error over rooms of the mean over seeds; count: rooms. Throws Error when no room is left.
Measure over_rooms(const std::vector<std::vector<double>>& values);

/// Ours less theirs over equal rooms and seeds, [room][seed], by that rule.
struct PairedDifference {
  double mean = 0, spread = 0;
  int rooms = 0;
  /// "lower" or "higher" when the mean is more than two spreads from 0, else "none"; "one room" where there is no more.
  const char* verdict() const;
};
/// Rooms where either is not finite are left out. Throws Error when none is left.
PairedDifference paired_difference(const std::vector<std::vector<double>>& ours,
                                   const std::vector<std::vector<double>>& theirs);

}  // namespace clerestory
