// Tables and plots of the study of error against time.
#pragma once
#include <map>
#include <string>

#include "experiments/studies/error_time_parts.hpp"
#include "experiments/studies/findings.hpp"
#include "host/report/plot.hpp"

namespace clerestory {

/// Where the seconds of the nets that predict maps stand: Finding::region.
inline constexpr auto kMapsRegion = "maps";
/// Where what a part finds of a picture or a gradient stands: Finding::region.
std::string region_of(const ErrorTimePart& part, const std::string& what);

/// Double where the device has it and the light has no nets, whose states are in single precision.
Precision truth_precision(const ErrorTimePart& part, const Device& device);

class ErrorTimeTables {
 public:
  /// All of these must outlive it.
  ErrorTimeTables(const Config& config, const std::vector<ErrorTimePart>& parts, const Findings& found,
                  const Device& device)
      : config_(config), parts_(parts), found_(found), device_(device) {}

  /// "error_time", a row for each estimator: seconds to an error, slopes; "by_part", of the parts against a plain
  /// estimator: the factors; and a table of each part, a row for each number of samples.
  std::map<std::string, Table> tables() const;
  /// Error against seconds: a plot for each part, of gradients for each map.
  std::map<std::string, Plot> plots() const;

 private:
  struct Curve;
  Curve curve(const ErrorTimePart& part, const std::string& what, const TimedEstimator& estimator) const;
  std::vector<double> seconds(const ErrorTimePart& part, const TimedEstimator& estimator) const;
  std::string sentence(const ErrorTimePart& part) const;
  Table table_of(const ErrorTimePart& part) const;
  Table headline() const;
  Table by_part() const;
  double maps_seconds() const;

  const Config& config_;
  const std::vector<ErrorTimePart>& parts_;
  const Findings& found_;
  const Device& device_;
};

/// A table as comma-separated values: a line of names with their units, then all digits; a column of deviations behind
/// each that has them.
std::string table_csv(const Table& table);

}  // namespace clerestory
