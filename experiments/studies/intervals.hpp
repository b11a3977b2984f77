// Figures over rooms with their interval of 95 %, by a bootstrap over the rooms (host/math/bootstrap.hpp).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/math/bootstrap.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// The mean over rooms and its interval; nothing of less than two rooms. Rooms that are not finite are left out.
std::optional<Difference> interval_over(const std::vector<double>& rooms);
/// Mean over rooms ± half the interval; of one room its value alone, of none nothing. Rooms that are not finite are
/// left out.
Cell with_interval(const std::vector<double>& rooms);

/// One answer less another, room by room; rooms where either is not finite are left out.
struct RoomwiseDifference {
  Measure difference;   // mean ± half the interval
  std::string verdict;  // "higher", "lower"; "none" where the interval holds 0; "one room"
};
/// Nothing where no room has both. `mine` and `other` have an entry a room.
std::optional<RoomwiseDifference> roomwise_difference(const std::vector<double>& mine,
                                                      const std::vector<double>& other);

}  // namespace clerestory
