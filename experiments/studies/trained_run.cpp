#include "experiments/studies/trained_run.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "host/math/statistics.hpp"
#include "host/report/metrics.hpp"

namespace clerestory {

double median_step_seconds(const std::filesystem::path& run, int batch) {
  std::vector<double> seconds;
  for (const double speed : curve_of(read_metrics(run / "metrics.jsonl"), "time/views_per_second").values)
    if (std::isfinite(speed) && speed > 0) seconds.push_back(batch / speed);
  return seconds.empty() ? std::numeric_limits<double>::quiet_NaN() : median(std::span<const double>(seconds));
}

}  // namespace clerestory
