// Sweeps: lists of values in overrides become the Cartesian product of runs.
#include <algorithm>

#include "host/io/config_values.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kMostRuns = 100000;  // a slip of the pen such as range(0,1000000000) ends here, not in memory

std::vector<std::string> range_values(const std::string& text, const std::string& where) {
  long long first = 0, last = 0;
  int used = 0;
  if (std::sscanf(text.c_str(), "range(%lld,%lld)%n", &first, &last, &used) != 2 ||
      used != static_cast<int>(text.size()) || first >= last)
    throw usage_error("not a range", where, text, "range(a,b) with a < b");
  if (static_cast<unsigned long long>(last) - static_cast<unsigned long long>(first) > kMostRuns)
    throw usage_error("range too long", where, text, fmt::format("at most {} values", kMostRuns));
  std::vector<std::string> values;
  for (long long v = first; v < last; ++v) values.push_back(std::to_string(v));
  return values;
}

std::vector<std::string> alternatives(const std::string& text, const std::string& where) {
  if (text.starts_with("range(")) return range_values(text, where);
  std::vector<std::string> values = split_values(text);
  if (values.size() > 1 && std::ranges::find(values, "") != values.end())
    throw usage_error("an empty value between commas", where);
  return values;
}

}  // namespace

std::vector<std::vector<std::string>> expand_sweep(const std::vector<std::string>& overrides) {
  std::vector<std::vector<std::string>> runs(1);
  for (const std::string& text : overrides) {
    const auto equals = text.find('=');
    const std::string key = text.substr(0, equals == std::string::npos ? text.size() : equals + 1);
    std::vector<std::string> values =
        equals == std::string::npos ? std::vector<std::string>{""} : alternatives(text.substr(equals + 1), text);
    if (runs.size() * values.size() > kMostRuns)
      throw usage_error("the sweep is too large", text, fmt::format("{} runs", runs.size() * values.size()),
                        fmt::format("at most {}", kMostRuns));
    std::vector<std::vector<std::string>> grown;
    for (const auto& run : runs)
      for (const std::string& value : values) {
        grown.push_back(run);
        grown.back().push_back(key + value);
      }
    runs = std::move(grown);
  }
  return runs;
}

}  // namespace clerestory
