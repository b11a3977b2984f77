// What studies find: numbers, each with what it measures, where, of whom, under what and which of several it is.
#pragma once
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/report/metrics.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// The name of one number. What has no meaning for a metric is left empty.
struct Finding {
  std::string metric;       // "relmse", "seconds"
  std::string region = {};  // what is judged: "render", "hits", a map
  std::string who = {};     // who is judged: a light, a rung of a ladder
  std::string under = {};   // on what: predicted or true maps, an edit
  std::string item = {};    // which of several: a seed, a probe

  auto operator<=>(const Finding&) const = default;
  Finding of(std::int64_t number) const;  // the same with that item
};
/// As a record's key in metrics.jsonl: the five parts between bars, "relmse|render|net|true|0". Throws Error when a
/// part holds a bar.
std::string text_of(const Finding& finding);
/// Back. Throws usage_error naming `where` on any other text.
Finding finding_from(const std::string& text, const std::string& where);

/// The numbers of one room.
class RoomFindings {
 public:
  /// Several of one name (views of a room, say) count as their mean.
  void add(const Finding& finding, double value) { lists_[finding].push_back(value); }
  /// Several of one name are summed up.
  void sum(const Finding& finding, double value) { sums_[finding] += value; }
  std::vector<std::pair<std::string, double>> values() const;  // by text_of()

 private:
  std::map<Finding, std::vector<double>> lists_;
  std::map<Finding, double> sums_;
};

/// The numbers of all rooms of a study, as its records have them.
class Findings {
 public:
  using BySeed = std::vector<std::vector<double>>;  // [room][seed]

  /// Throws usage_error naming `where` when a record's key is no Finding.
  void add_room(const MetricRecord& record, const std::string& where);
  std::size_t rooms() const { return rooms_.size(); }

  std::optional<double> value(std::size_t room, const Finding& finding) const;
  /// The same, or NaN.
  double value_or_nan(std::size_t room, const Finding& finding) const;
  /// Of every room that has it.
  std::vector<double> values(const Finding& finding) const;
  /// Items 0 to seeds - 1 of every room, NaN where a room lacks one.
  BySeed by_seed(const Finding& finding, std::int64_t seeds) const;
  /// The same of those that are there; rooms without any are left out.
  BySeed present_by_seed(const Finding& finding, std::int64_t seeds) const;
  /// Means over rooms, one a seed; of values that are finite. Seeds that no room has are left out.
  std::vector<double> seed_means(const Finding& finding, std::int64_t seeds) const;
  /// Every item of that name in one room, by item; not finite ones too.
  std::map<std::string, double> items(std::size_t room, const Finding& finding) const;
  /// All items of all rooms that are finite.
  std::vector<double> finite_items(const Finding& finding) const;
  /// Means over the finite items of each room that has one.
  std::vector<double> room_means(const Finding& finding) const;

 private:
  std::vector<std::map<Finding, double>> rooms_;
};

}  // namespace clerestory
