// Verdicts on devices as people read them: totals, tables, a page.
#pragma once
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "experiments/commands/cli.hpp"
#include "host/report/table.hpp"

namespace clerestory {

struct Totals {
  std::set<std::string> kernels;
  std::size_t devices = 0, refused = 0, failed = 0, unexplained = 0;
  std::vector<std::string> at_fault;  // devices that programs would use
};
/// Of {devices: [verdict_on()...]}, as all below. Throws nlohmann::json::exception where a key lacks.
Totals totals_of(const nlohmann::ordered_json& all);
/// "kernels K devices D failed F unexplained U".
std::string totals_text(const Totals& totals);

/// The device of a verdict, with what it is pretended to be without and what its driver is told.
std::string label_of(const nlohmann::ordered_json& verdict);
Table devices_table(const nlohmann::ordered_json& all);
/// A row a variant, of each device the errors of its value and gradient.
Table kernels_table(const nlohmann::ordered_json& all);
Table failures_table(const nlohmann::ordered_json& all);

/// Throws usage_error, before the work, where `file` is neither .md nor .html or cannot be written; it may be empty.
void expect_report_name(const std::filesystem::path& file);
void write_report(const std::filesystem::path& file, const nlohmann::ordered_json& all, const CommonOptions& common);

}  // namespace clerestory
