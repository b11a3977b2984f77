#include "experiments/studies/intervals.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace clerestory {
namespace {

constexpr std::uint64_t kSeed = 1;  // of the bootstrap's draws

Measure half_width(const Difference& of, std::size_t rooms) {
  return {of.mean, 0.5 * (of.high - of.low), static_cast<int>(rooms)};
}

}  // namespace

std::optional<Difference> interval_over(const std::vector<double>& rooms) {
  std::vector<double> finite;
  std::ranges::copy_if(rooms, std::back_inserter(finite), [](double v) { return std::isfinite(v); });
  if (finite.size() < 2) return {};
  return paired_bootstrap({finite}, {std::vector<double>(finite.size(), 0.0)}, kSeed);
}

Cell with_interval(const std::vector<double>& rooms) {
  const auto all = roomwise_difference(rooms, std::vector<double>(rooms.size(), 0.0));
  if (!all) return {};
  return all->interval ? half_width(*all->interval, static_cast<std::size_t>(all->rooms)) : Measure{all->mean};
}

std::optional<RoomwiseDifference> roomwise_difference(const std::vector<double>& mine,
                                                      const std::vector<double>& other) {
  std::vector<double> a, b;
  for (std::size_t r = 0; r < mine.size(); ++r)
    if (std::isfinite(mine[r]) && std::isfinite(other[r])) a.push_back(mine[r]), b.push_back(other[r]);
  if (a.empty()) return {};
  if (a.size() == 1) return RoomwiseDifference{a[0] - b[0], {}, 1, "one room"};
  const Difference d = paired_bootstrap({a}, {b}, kSeed);
  return RoomwiseDifference{d.mean, d, static_cast<int>(a.size()),
                            d.low > 0    ? "higher"
                            : d.high < 0 ? "lower"
                                         : "none"};
}

void add_difference_columns(Table& table, const std::string& unit, const std::string& verdict) {
  for (const Column& column :
       {Column{"difference", unit}, Column{"from", "95 %"}, Column{"up to", "95 %"}, Column{verdict}})
    table.columns.push_back(column);
}

void add_difference(std::vector<Cell>& row, const RoomwiseDifference& of) {
  const auto& ends = of.interval;
  row.insert(row.end(), {Measure{of.mean}, ends ? Cell(Measure{ends->low}) : Cell(),
                         ends ? Cell(Measure{ends->high}) : Cell(), of.verdict});
}

}  // namespace clerestory
