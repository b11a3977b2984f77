// Metrics of a run, which goes on from step 2.
#include "host/report/metrics.hpp"

#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("metrics", "metrics.jsonl", [](const std::filesystem::path& file) {
  const std::vector<MetricRecord> records = read_metrics(file);
  for (const std::string& name : metric_names(records)) thinned(curve_of(records, name), 3);
  cut_metrics(file, 2);
  MetricsWriter(file).write(3, {{"loss", 0.5}});
  read_metrics(file);
});

}  // namespace clerestory
