#include "experiments/evaluation/benchmark.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nyu.hpp"
#include "host/io/openrooms.hpp"
#include "host/math/statistics.hpp"
#include "host/report/sha256.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// PSNR of equal pictures, which leaves no mean.
std::size_t infinite_of(const std::vector<double>& figures) {
  return static_cast<std::size_t>(std::ranges::count_if(figures, [](double v) { return std::isinf(v); }));
}

std::string hash_of(const std::vector<std::string>& names) {
  std::string text, hex;
  for (const std::string& name : names) text += name + "\n";
  for (const char byte : sha256(text)) hex += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return hex;
}

}  // namespace

Protocol protocol_of(const std::string& word) {
  return word == "zhu" ? Protocol::Zhu : word == "li" ? Protocol::Li : Protocol::Marigold;
}

DataLayout layout_of(const fs::path& data) {
  if (fs::is_regular_file(data) || fs::exists(data / kNyuFile)) return DataLayout::Nyu;
  if (is_openrooms(data)) return DataLayout::OpenRooms;
  std::error_code code;
  fs::directory_iterator entries(data, code);
  if (code) throw usage_error("the folder cannot be read: " + code.message(), data.string());
  for (const auto& entry : entries) {
    fs::path picture = entry.path();
    if (picture.extension() == ".json" &&
        (fs::exists(picture.replace_extension(".png")) || fs::exists(picture.replace_extension(".jpg"))))
      return DataLayout::Iiw;
  }
  return DataLayout::Rooms;
}

std::vector<std::string> read_list(const fs::path& file, const std::vector<std::string>& known) {
  std::istringstream lines(read_file(file, std::uint64_t{1} << 26));
  const std::set<std::string> all(known.begin(), known.end());
  std::vector<std::string> names;
  std::set<std::string> seen;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line.resize(line.find_last_not_of(" \t\r") + 1);
    if (line.empty()) continue;
    const std::string name = fs::path(line).stem().string();
    const std::string where = fmt::format("{}:{}", file.string(), number);
    if (!all.empty() && !all.contains(name)) throw usage_error("the data set has no such picture", where, line);
    if (!seen.insert(name).second) throw usage_error("the picture is listed twice", where, line);
    names.push_back(name);
  }
  if (names.empty()) throw usage_error("lists no picture", file.string());
  return names;
}

BenchmarkResult run_benchmark(const Benchmark& benchmark, const std::function<PredictedMaps(std::size_t)>& predict) {
  BenchmarkResult result;
  result.metrics = benchmark.metrics, result.names = benchmark.names, result.conventions = benchmark.conventions;
  result.figures.resize(benchmark.metrics.size());
  std::int64_t pairs = 0, passed_over = 0;
  for (std::size_t i = 0; i < benchmark.names.size(); ++i) {
    BenchmarkFigures figures = benchmark.judge(i, predict(i));
    for (std::size_t m = 0; m < figures.values.size(); ++m)
      if (figures.values[m]) result.figures[m].push_back(*figures.values[m]);
    pairs += figures.pairs, passed_over += figures.passed_over;
    result.pictures.push_back(std::move(figures));
  }
  for (const BenchmarkMetric& metric : result.metrics)
    result.conventions.push_back(fmt::format("{}: {}", metric.name, metric.convention));
  result.facts = {{"protocol", benchmark.protocol},
                  {"layout", benchmark.layout},
                  {"pictures", fmt::format("{}", benchmark.names.size())},
                  {"sha256 of their list", hash_of(benchmark.names)}};
  if (pairs + passed_over > 0)
    result.facts.emplace_back("pairs", fmt::format("{} count, {} passed over", pairs, passed_over));
  return result;
}

Table benchmark_table(const BenchmarkResult& result) {
  Table table{"Errors: mean ± standard deviation over pictures",
              {{"metric", "", Best::None},
               {"mean", "", Best::None, 5},
               {"median", "", Best::None, 5},
               {"pictures", "", Best::None, 6}},
              {}};
  for (std::size_t m = 0; m < result.metrics.size(); ++m) {
    const BenchmarkMetric& metric = result.metrics[m];
    const std::vector<double>& figures = result.figures[m];
    Cell average = measure_or_nothing(figures), middle;
    if (infinite_of(figures) > 0)
      average = middle = "infinite";
    else if (!figures.empty())
      middle = Measure{median(std::span<const double>(figures)), 0, 1};
    table.add({metric.unit.empty() ? metric.name : fmt::format("{} [{}]", metric.name, metric.unit), average, middle,
               fmt::format("{}", figures.size())});
  }
  return table;
}

std::string benchmark_json(const BenchmarkResult& result) {
  nlohmann::ordered_json out;
  for (const auto& [key, value] : result.facts) out["facts"][key] = value;
  out["conventions"] = result.conventions;
  for (std::size_t m = 0; m < result.metrics.size(); ++m) {
    nlohmann::ordered_json one{{"unit", result.metrics[m].unit}, {"pictures", result.figures[m].size()}};
    if (const std::size_t infinite = infinite_of(result.figures[m]))
      one["infinite"] = infinite;
    else if (!result.figures[m].empty())
      one["mean"] = mean(std::span<const double>(result.figures[m])),
      one["median"] = median(std::span<const double>(result.figures[m]));
    out["metrics"][result.metrics[m].key] = std::move(one);
  }
  out["pictures"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < result.names.size(); ++i) {
    nlohmann::ordered_json one{{"picture", result.names[i]}};
    for (std::size_t m = 0; m < result.metrics.size(); ++m)
      if (const auto& value = result.pictures[i].values[m]) one[result.metrics[m].key] = *value;
    out["pictures"].push_back(std::move(one));
  }
  return json_text(out) + "\n";  // names may be in any encoding
}

}  // namespace clerestory
