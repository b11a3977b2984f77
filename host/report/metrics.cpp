// Reading, appending to and cutting metrics.jsonl.
#include "host/report/metrics.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nesting.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;  // of the file
constexpr std::size_t kLongestLine = 1 << 26;                 // a study's room by a thousand seeds has some 40 MB

/// The whole lines of the file; bytes after the last newline are a record that was being written when a run died.
std::string whole_lines(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return {};
  std::string text = read_file(path, kMostBytes, true);
  const auto last = text.rfind('\n');
  text.resize(last == std::string::npos ? 0 : last + 1);
  return text;
}

MetricRecord record_of(const std::string& line, const std::string& where) {
  if (line.size() > kLongestLine)
    throw usage_error("a line is too long", where, fmt::format("{} bytes", line.size()),
                      fmt::format("at most {}", kLongestLine));
  check_nesting(line, where);
  try {
    const Json json = Json::parse(line);
    MetricRecord record;
    record.step = whole_number<std::int64_t>(json.at("step"), "step", where);
    record.seconds = json.at("seconds").get<double>();
    for (const auto& [name, value] : json.items())
      if (name != "step" && name != "seconds")
        record.values.emplace_back(name, value.is_null() ? std::nan("") : value.get<double>());
    return record;
  } catch (const Json::exception& error) {
    throw usage_error(std::string("not a record of metrics: ") + error.what(), where);
  }
}

template <class Visit>
void for_each_line(const std::filesystem::path& path, const std::string& text, const Visit& visit) {
  std::size_t from = 0;
  for (int number = 1; from < text.size(); ++number) {
    const std::size_t end = text.find('\n', from);
    const std::string line = text.substr(from, end - from);
    visit(line, record_of(line, fmt::format("{}:{}", path.string(), number)));
    from = end + 1;
  }
}

}  // namespace

MetricsWriter::MetricsWriter(const std::filesystem::path& path) : path_(path) {
  const std::string text = whole_lines(path);
  start_ = clock_seconds();
  for_each_line(path, text,
                [&](const std::string&, const MetricRecord& last) { start_ = clock_seconds() - last.seconds; });
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) throw usage_error(std::string("cannot be written: ") + std::strerror(errno), path.string());
  if (::ftruncate(file_, static_cast<off_t>(text.size())) != 0) {
    const int reason = errno;
    ::close(file_);
    throw Error(ErrorKind::Failed, std::string("cannot be cut: ") + std::strerror(reason), path.string());
  }
}

MetricsWriter::~MetricsWriter() { ::close(file_); }

double MetricsWriter::seconds() const { return clock_seconds() - start_; }

void MetricsWriter::write(std::int64_t step, const std::vector<std::pair<std::string, double>>& values) {
  std::string line = fmt::format("{{\"step\":{},\"seconds\":{:.3f}", step, seconds());
  for (const auto& [name, value] : values) {
    line += "," + json_text(Json(name), -1) + ":";
    line += std::isfinite(value) ? fmt::format("{}", value) : "null";
  }
  line += "}\n";
  const ssize_t written = ::write(file_, line.data(), line.size());
  if (written != static_cast<ssize_t>(line.size()))
    throw Error(ErrorKind::Failed,
                std::string("cannot be written: ") + (written < 0 ? std::strerror(errno) : "no space left"),
                path_.string());
}

std::vector<MetricRecord> read_metrics(const std::filesystem::path& path) {
  std::vector<MetricRecord> records;
  for_each_line(path, whole_lines(path),
                [&](const std::string&, MetricRecord record) { records.push_back(std::move(record)); });
  return records;
}

void cut_metrics(const std::filesystem::path& path, std::int64_t step) {
  if (!std::filesystem::exists(path)) return;
  std::string kept;
  for_each_line(path, whole_lines(path), [&](const std::string& line, const MetricRecord& record) {
    if (record.step <= step) kept += line + "\n";
  });
  write_file(path, kept);
}

Curve curve_of(const std::vector<MetricRecord>& records, const std::string& name) {
  Curve curve;
  for (const MetricRecord& record : records)
    for (const auto& [key, value] : record.values)
      if (key == name) curve.steps.push_back(static_cast<double>(record.step)), curve.values.push_back(value);
  return curve;
}

Curve thinned(const Curve& curve, std::size_t most) {
  const std::size_t run = (curve.steps.size() + most - 1) / most;
  if (run <= 1) return curve;
  Curve thin;
  for (std::size_t from = 0; from < curve.steps.size(); from += run) {
    const std::size_t end = std::min(from + run, curve.steps.size());
    double step = 0, value = 0, finite = 0;
    for (std::size_t i = from; i < end; ++i) {
      step += curve.steps[i];
      if (std::isfinite(curve.values[i])) value += curve.values[i], ++finite;
    }
    thin.steps.push_back(step / static_cast<double>(end - from));
    thin.values.push_back(finite > 0 ? value / finite : std::nan(""));
  }
  return thin;
}

std::vector<std::string> metric_names(const std::vector<MetricRecord>& records) {
  std::vector<std::string> names;
  for (const MetricRecord& record : records)
    for (const auto& [key, value] : record.values)
      if (std::ranges::find(names, key) == names.end()) names.push_back(key);
  return names;
}

}  // namespace clerestory
