#include "experiments/commands/check_stability.hpp"

#include <algorithm>
#include <cstdio>

#include "checks/stability/stability_check.hpp"
#include "experiments/commands/check_report.hpp"
#include "host/io/json_file.hpp"
#include "host/report/progress.hpp"
#include "host/report/table.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

struct Checked {
  const StabilityCase* of;
  StabilityRow row;
  double seconds = 0;
};

std::vector<Checked> check_all(const std::vector<std::string>& only, const CheckedDevices& devices) {
  std::vector<Checked> rows;
  for (const StabilityCase& c : stability_cases())
    if (only.empty() || std::ranges::count(only, c.group)) rows.push_back({&c, {}});
  Progress bar("check", static_cast<std::int64_t>(rows.size()), "cases");
  for (Checked& each : rows) {
    const Stopwatch watch;
    each.row = check_stability(*each.of, devices);
    each.seconds = watch.seconds();
    bar.advance(each.of->group);
    give_up_if_interrupted("check");
  }
  return rows;
}

std::string finite_text(long bad) { return bad == 0 ? "yes" : fmt::format("{} not", bad); }

Table rows_table(const std::vector<Checked>& rows, const CheckedDevices& devices) {
  Table table;
  table.title = "Stability on " + devices.single.info().name;
  table.note =
      "Errors of float against the same kernels in double at the same floats, relative, 99.9th percentile. Inside the "
      "documented domain (docs/stability.md) they have bars; outside everything has to be finite and counted. " +
      twins_text(devices, "nothing is compared, but whether all is finite is asked.");
  for (const char* name : {"group", "case", "domain", "evaluations", "values finite", "gradients finite"})
    table.columns.push_back({name, "", Best::None, 2});
  for (const char* name : {"value error", "gradient error"}) table.columns.push_back({name, "", Best::None, 2});
  table.columns.push_back({"dropped", "", Best::None, 0});
  table.columns.push_back({"time", "s", Best::None, 2});
  table.columns.push_back({"state", "", Best::None, 0});
  const auto error = [](double e) { return std::isnan(e) ? Cell() : Cell(fmt::format("{:.1e}", e)); };
  for (const auto& [c, row, seconds] : rows)
    table.add({c->group, c->name, c->inside ? "inside" : "outside", fmt::format("{}", row.evaluations),
               finite_text(row.bad_values), finite_text(row.bad_gradients), error(row.value_error),
               error(row.gradient_error), fmt::format("{:g}", row.dropped), Measure{seconds},
               row.faults.empty() ? "ok" : "FAULT"});
  return table;
}

std::vector<std::string> all_faults(const std::vector<Checked>& rows) {
  std::vector<std::string> faults;
  for (const Checked& each : rows) faults.insert(faults.end(), each.row.faults.begin(), each.row.faults.end());
  return faults;
}

std::vector<std::string> wrong_cases(const std::vector<Checked>& rows) {
  std::vector<std::string> wrong;
  for (const Checked& each : rows)
    if (!each.row.faults.empty()) wrong.push_back(each.of->label());
  return wrong;
}

std::string totals_text(const std::vector<Checked>& rows) {
  long evaluations = 0, inside = 0;
  double dropped = 0, seconds = 0;
  for (const Checked& each : rows) {
    evaluations += each.row.evaluations, inside += each.of->inside;
    if (each.of->inside) dropped += each.row.dropped;
    seconds += each.seconds;
  }
  return fmt::format(
      "{} cases, {} inside the documented domain; {} evaluations, {:g} dropped inside; {} at fault; {}\n", rows.size(),
      inside, evaluations, dropped, wrong_cases(rows).size(), duration_text(seconds));
}

std::string rows_json(const std::vector<Checked>& rows, const CheckedDevices& devices) {
  nlohmann::ordered_json all = devices_json(devices);
  all["faults"] = all_faults(rows).size();
  for (const auto& [c, row, seconds] : rows)
    all["cases"].push_back({{"group", c->group},
                            {"name", c->name},
                            {"inside", c->inside},
                            {"evaluations", row.evaluations},
                            {"evaluations_inside", row.inside},
                            {"values_not_finite", row.bad_values},
                            {"gradients_not_finite", row.bad_gradients},
                            {"value_error", row.value_error},
                            {"gradient_error", row.gradient_error},
                            {"value_bar", kStableValue},
                            {"gradient_bar", kStableGradient},
                            {"dropped", row.dropped},
                            {"largest_value", row.largest},
                            {"seconds", seconds},
                            {"faults", row.faults}});
  return json_text(all);
}

}  // namespace

std::vector<std::string> stability_groups() {
  std::vector<std::string> groups;
  for (const StabilityCase& c : stability_cases())
    if (!std::ranges::count(groups, c.group)) groups.push_back(c.group);
  return groups;
}

void check_stability_of(const CheckedDevices& devices, const std::vector<std::string>& only,
                        const CommonOptions& common) {
  const std::vector<Checked> rows = check_all(only, devices);
  if (!common.json || !common.json->empty()) {
    const std::string text =
        table_text(rows_table(rows, devices)) + "\n" + faults_text(all_faults(rows)) + totals_text(rows);
    std::fputs(terminal_text(text).c_str(), stdout);
  }
  if (common.json) write_json_result(common, rows_json(rows, devices));
  expect_none_wrong("case", wrong_cases(rows), devices);
}

}  // namespace clerestory
