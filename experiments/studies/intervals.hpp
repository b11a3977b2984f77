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

/// One answer less another, room by room; rooms where either is not finite are left out. Intervals of few rooms lean to
/// one side, so a table shows their ends, not a half width.
struct RoomwiseDifference {
  double mean = 0;
  std::optional<Difference> interval;  // none of one room
  int rooms = 0;
  std::string verdict;  // "higher", "lower"; "none" where the interval holds 0; "one room"
};
/// Columns "difference", "from", "up to" and, under the name `verdict`, what it is; and the cells below them.
void add_difference_columns(Table& table, const std::string& unit, const std::string& verdict);
void add_difference(std::vector<Cell>& row, const RoomwiseDifference& of);
/// Nothing where no room has both. `mine` and `other` have an entry a room.
std::optional<RoomwiseDifference> roomwise_difference(const std::vector<double>& mine,
                                                      const std::vector<double>& other);

}  // namespace clerestory
