#include "experiments/studies/findings.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr char kBar = '|';
constexpr std::array kParts{&Finding::metric, &Finding::region, &Finding::who, &Finding::under, &Finding::item};

std::vector<double> finite_of(const std::map<std::string, double>& items) {
  std::vector<double> values;
  for (const auto& [item, value] : items)
    if (std::isfinite(value)) values.push_back(value);
  return values;
}

}  // namespace

Finding Finding::of(std::int64_t number) const {
  Finding one = *this;
  one.item = std::to_string(number);
  return one;
}

std::string text_of(const Finding& finding) {
  std::string text;
  for (const auto part : kParts) {
    if ((finding.*part).find(kBar) != std::string::npos)
      throw Error(ErrorKind::Failed, "a part of a finding's name holds a bar", "findings", finding.*part);
    text += (part == kParts[0] ? "" : std::string(1, kBar)) + finding.*part;
  }
  return text;
}

Finding finding_from(const std::string& text, const std::string& where) {
  Finding finding;
  std::size_t at = 0;
  for (const auto part : kParts) {
    const std::size_t bar = text.find(kBar, at);
    if ((bar == std::string::npos) != (part == kParts.back()))
      throw usage_error("not a record of this study", where, text, "five parts between bars; a new run.variant");
    finding.*part = text.substr(at, bar - at);
    at = bar + 1;
  }
  return finding;
}

std::vector<std::pair<std::string, double>> RoomFindings::values() const {
  std::vector<std::pair<std::string, double>> all;
  for (const auto& [finding, list] : lists_) all.emplace_back(text_of(finding), mean(list));
  for (const auto& [finding, value] : sums_) all.emplace_back(text_of(finding), value);
  return all;
}

void Findings::add_room(const MetricRecord& record, const std::string& where) {
  std::map<Finding, double>& room = rooms_.emplace_back();
  for (const auto& [text, value] : record.values) room[finding_from(text, where)] = value;
}

std::optional<double> Findings::value(std::size_t room, const Finding& finding) const {
  const auto found = rooms_.at(room).find(finding);
  return found == rooms_[room].end() ? std::nullopt : std::optional(found->second);
}

double Findings::value_or_nan(std::size_t room, const Finding& finding) const {
  return value(room, finding).value_or(std::numeric_limits<double>::quiet_NaN());
}

std::vector<double> Findings::values(const Finding& finding) const {
  std::vector<double> all;
  for (std::size_t r = 0; r < rooms(); ++r)
    if (const std::optional<double> v = value(r, finding)) all.push_back(*v);
  return all;
}

Findings::BySeed Findings::by_seed(const Finding& finding, std::int64_t seeds) const {
  BySeed all(rooms());
  for (std::size_t r = 0; r < rooms(); ++r)
    for (std::int64_t s = 0; s < seeds; ++s) all[r].push_back(value_or_nan(r, finding.of(s)));
  return all;
}

Findings::BySeed Findings::present_by_seed(const Finding& finding, std::int64_t seeds) const {
  BySeed all;
  for (std::size_t r = 0; r < rooms(); ++r) {
    std::vector<double> of_room;
    for (std::int64_t s = 0; s < seeds; ++s)
      if (const std::optional<double> v = value(r, finding.of(s))) of_room.push_back(*v);
    if (!of_room.empty()) all.push_back(std::move(of_room));
  }
  return all;
}

std::vector<double> Findings::seed_means(const Finding& finding, std::int64_t seeds) const {
  std::vector<double> means;
  for (std::int64_t s = 0; s < seeds; ++s) {
    std::vector<double> of_rooms;
    for (const double v : values(finding.of(s)))
      if (std::isfinite(v)) of_rooms.push_back(v);
    if (!of_rooms.empty()) means.push_back(mean(of_rooms));
  }
  return means;
}

std::map<std::string, double> Findings::items(std::size_t room, const Finding& finding) const {
  const auto same = [&](Finding other) {
    other.item = finding.item;
    return other == finding;
  };
  std::map<std::string, double> found;
  for (const auto& [other, value] : rooms_.at(room))
    if (same(other)) found.emplace(other.item, value);
  return found;
}

std::vector<double> Findings::finite_items(const Finding& finding) const {
  std::vector<double> all;
  for (std::size_t r = 0; r < rooms(); ++r)
    for (const double v : finite_of(items(r, finding))) all.push_back(v);
  return all;
}

std::vector<double> Findings::room_means(const Finding& finding) const {
  std::vector<double> means;
  for (std::size_t r = 0; r < rooms(); ++r)
    if (const std::vector<double> of_room = finite_of(items(r, finding)); !of_room.empty())
      means.push_back(mean(of_room));
  return means;
}

}  // namespace clerestory
