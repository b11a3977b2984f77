// metrics.jsonl: the curves of a run, one JSON object a line, only ever appended to.
//   {"step":120,"seconds":31.7,"train/loss":0.0412,"val/depth":null}
// Every record is one write to the file, so a killed run leaves at most one torn line, which is dropped on opening.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace clerestory {

struct MetricRecord {
  std::int64_t step = 0;
  double seconds = 0;                                  // wall time of the run, breaks not counted
  std::vector<std::pair<std::string, double>> values;  // NaN and Inf are stored as null and read as NaN
};

class MetricsWriter {
 public:
  /// Appends to `path`; `seconds` go on from the last record.
  explicit MetricsWriter(const std::filesystem::path& path);
  ~MetricsWriter();
  MetricsWriter(const MetricsWriter&) = delete;
  MetricsWriter& operator=(const MetricsWriter&) = delete;

  void write(std::int64_t step, const std::vector<std::pair<std::string, double>>& values);
  double seconds() const;

 private:
  int file_ = -1;
  std::filesystem::path path_;
  double start_ = 0;
};

/// All whole records, in order. A missing file is empty. A broken line anywhere but at the end throws with its number.
std::vector<MetricRecord> read_metrics(const std::filesystem::path& path);

/// Drops records after `step` and a torn last line, atomically: what a resumed run does before it appends again.
void cut_metrics(const std::filesystem::path& path, std::int64_t step);

/// One curve: the records that hold `name`.
struct Curve {
  std::vector<double> steps, values;
};
Curve curve_of(const std::vector<MetricRecord>& records, const std::string& name);
/// At most `most` points: means over equal runs of neighbours, NaN left out (a run of NaN alone gives NaN).
Curve thinned(const Curve& curve, std::size_t most);
/// All names that occur, in order of first appearance.
std::vector<std::string> metric_names(const std::vector<MetricRecord>& records);

}  // namespace clerestory
