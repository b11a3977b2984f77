#include "experiments/commands/check.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "checks/op_check.hpp"
#include "experiments/commands/check_report.hpp"
#include "experiments/commands/check_stability.hpp"
#include "experiments/commands/cli.hpp"
#include "host/io/config_values.hpp"
#include "host/report/progress.hpp"
#include "host/report/table.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

/// What the cases of one stem showed.
struct OpReport {
  int cases = 0;
  std::set<std::string> kernels;  // of its own, seen to run
  OpFindings findings;
  double seconds = 0;
};
using OpReports = std::map<std::string, OpReport>;

struct CaseToRun {
  const OpCase* op_case;
  Bodies bodies;
};

std::vector<std::string> known_stems() {
  std::set<std::string> stems;
  for (const OpCase& c : declared_cases()) stems.insert(c.stem);
  return {stems.begin(), stems.end()};
}

void expect_known(const std::vector<std::string>& only, const std::vector<std::string>& known, const char* what) {
  for (const std::string& name : only)
    if (!std::ranges::count(known, name))
      throw usage_error(fmt::format("no such {}, the nearest is {}", what, nearest_word(name, known)), "--only", name,
                        fmt::format("{}", fmt::join(known, ", ")));
}

/// All cases in all bodies of their kernels; `only` empty: of all ops.
std::vector<CaseToRun> cases_to_run(const std::vector<std::string>& only) {
  std::vector<CaseToRun> chosen;
  for (const OpCase& c : declared_cases()) {
    if (!only.empty() && !std::ranges::count(only, c.stem)) continue;
    for (const Bodies bodies : bodies_of(c)) chosen.push_back({&c, bodies});
  }
  return chosen;
}

OpReports check_all(const std::vector<CaseToRun>& chosen, const CheckedDevices& devices) {
  OpReports reports;
  Progress bar("check", static_cast<std::int64_t>(chosen.size()), "cases");
  for (const CaseToRun& each : chosen) {
    OpReport& report = reports[each.op_case->stem];
    const Stopwatch watch;
    const OpFindings found = check_op(*each.op_case, devices, each.bodies);
    report.seconds += watch.seconds(), ++report.cases;
    report.findings.add(found);
    for (const std::string& kernel : each.op_case->kernels)
      if (found.launched.contains(kernel)) report.kernels.insert(kernel);
    bar.advance(each.op_case->stem);
    give_up_if_interrupted("check");
  }
  return reports;
}

std::vector<std::string> all_faults(const OpReports& reports) {
  std::vector<std::string> faults;
  for (const auto& [stem, report] : reports)
    faults.insert(faults.end(), report.findings.faults.begin(), report.findings.faults.end());
  return faults;
}

Table reports_table(const OpReports& reports, const CheckedDevices& devices) {
  Table table;
  table.title = "Ops on " + devices.single.info().name;
  table.note =
      "Errors are the worst of all cases, as shares of what a case allows: over 1 is a fault. " +
      twins_text(devices, "values in float are compared with the references alone, and no gradient with differences.");
  for (const char* name :
       {"op", "cases", "kernels", "float against reference", "float against double", "gradient against differences"})
    table.columns.push_back({name, "", Best::None, 2});
  table.columns.push_back({"time", "s", Best::None, 2});
  table.columns.push_back({"state", "", Best::None, 0});
  const auto share = [](double error) { return std::isnan(error) ? Cell() : Cell(Measure{error}); };
  for (const auto& [stem, report] : reports) {
    const OpFindings& f = report.findings;
    table.add({stem, fmt::format("{}", report.cases), fmt::format("{}", report.kernels.size()), share(f.value_error),
               share(f.twin_error), share(f.gradient_error), Measure{report.seconds},
               f.faults.empty() ? "ok" : "FAULT"});
  }
  return table;
}

/// Errors that were not compared are null; so is one beyond all numbers, whose fault says so.
std::string check_json(const OpReports& reports, const CheckedDevices& devices) {
  nlohmann::ordered_json all = devices_json(devices);
  all["faults"] = all_faults(reports).size();
  for (const auto& [stem, report] : reports)
    all["ops"].push_back({{"stem", stem},
                          {"cases", report.cases},
                          {"kernels", report.kernels},
                          {"value_error", report.findings.value_error},
                          {"twin_error", report.findings.twin_error},
                          {"gradient_error", report.findings.gradient_error},
                          {"seconds", report.seconds},
                          {"faults", report.findings.faults}});
  return json_text(all);
}

void check_ops(const CheckedDevices& devices, const std::vector<std::string>& only, const CommonOptions& common) {
  const OpReports reports = check_all(cases_to_run(only), devices);
  if (!common.json || !common.json->empty())
    std::fputs(
        terminal_text(table_text(reports_table(reports, devices)) + "\n" + faults_text(all_faults(reports))).c_str(),
        stdout);
  if (common.json) write_json_result(common, check_json(reports, devices));
  std::vector<std::string> wrong;
  for (const auto& [stem, report] : reports)
    if (!report.findings.faults.empty()) wrong.push_back(stem);
  expect_none_wrong("op", wrong, devices);
}

struct Options {
  std::vector<std::string> only;
  bool stability = false;
};

void check(const Options& options, const CommonOptions& common) {
  if (options.stability)
    expect_known(options.only, stability_groups(), "group");
  else
    expect_known(options.only, known_stems(), "op");
  catch_interrupts();
  const CheckedDevices devices = checked_devices(Device::open(common.device));
  (options.stability ? check_stability_of : check_ops)(devices, options.only, common);
}

}  // namespace

void add_check_command(CommandLine& line) {
  auto options = std::make_shared<Options>();
  line.add("check", "Whether a device computes every op rightly, and how exactly")
      .flag("--stability", "stiff and extreme cases instead: finite? how far from double?", options->stability)
      .option("--only", "NAME,...",
              "these ops alone (conv, ssrt, ...: a kernel's file without its ending); with --stability: these groups",
              [options](const std::string& text) { options->only = read_names(text, "--only"); })
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes(
          "Compares with references in plain C++, with the same kernels in double, and gradients with differences;\n"
          "with --stability whole small graphs in float with the same in double (docs/stability.md).\n"
          "Ends with exit code 1 when there is a fault.")
      .run([options](const CommonOptions& common) { check(*options, common); });
}

}  // namespace clerestory
