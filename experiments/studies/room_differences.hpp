// Trainings of a sweep against each other, room by room.
#pragma once
#include "experiments/studies/sweep.hpp"

namespace clerestory {

/// For each point of the sweep, each list of rooms that judged it and each error: the mean over rooms and seeds, how
/// far it is from the first point's on the same rooms, and the interval of 95 % of that difference (paired_bootstrap).
/// The last column says "better" or "worse" than the first point, "none" where the interval holds 0, "one seed" where
/// there is no spread over trainings to compare with. Of runs that are done; a room that one of them has no error on
/// does not count.
Table room_differences(const std::vector<std::string>& keys, const std::vector<SweptPoint>& points);

}  // namespace clerestory
