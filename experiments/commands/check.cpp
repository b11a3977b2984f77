#include "experiments/commands/check.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "checks/op_check.hpp"
#include "experiments/commands/cli.hpp"
#include "host/io/config_values.hpp"
#include "host/report/progress.hpp"
#include "host/report/table.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kShownFaults = 20;

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

void expect_known(const std::vector<std::string>& only) {
  const std::vector<std::string> known = known_stems();
  for (const std::string& stem : only)
    if (!std::ranges::count(known, stem))
      throw usage_error(fmt::format("no such op, the nearest is {}", nearest_word(stem, known)), "--only", stem,
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

std::size_t count_faults(const OpReports& reports) {
  std::size_t count = 0;
  for (const auto& [stem, report] : reports) count += report.findings.faults.size();
  return count;
}

/// Where the twins in double ran.
std::string twins_text(const CheckedDevices& devices) {
  if (!devices.with_doubles)
    return "It has no doubles, and no other device here has: values in float are compared with the references alone, "
           "and no gradient with differences.";
  if (devices.twins_run_elsewhere())
    return "It has no doubles: the twins in double ran on " + devices.with_doubles->info().name + ".";
  return "The twins in double ran on it too.";
}

Table reports_table(const OpReports& reports, const CheckedDevices& devices) {
  Table table;
  table.title = "Ops on " + devices.single.info().name;
  table.note =
      "Errors are the worst of all cases, as shares of what a case allows: over 1 is a fault. " + twins_text(devices);
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

std::string faults_text(const OpReports& reports) {
  std::string text;
  std::size_t shown = 0;
  for (const auto& [stem, report] : reports)
    for (const std::string& fault : report.findings.faults)
      if (shown < kShownFaults) text += fault + "\n", ++shown;
  if (const std::size_t all = count_faults(reports); all > shown)
    text += fmt::format("{} further faults (--json names all)\n", all - shown);
  return text;
}

nlohmann::ordered_json device_json(const Device& device) {
  const DeviceInfo& info = device.info();
  return {{"index", info.index}, {"name", info.name}, {"platform", info.platform}, {"driver", info.driver}};
}

/// Errors that were not compared are null; so is one beyond all numbers, whose fault says so.
std::string check_json(const OpReports& reports, const CheckedDevices& devices) {
  nlohmann::ordered_json all{{"device", device_json(devices.single)}, {"twins", nullptr}};
  if (devices.with_doubles) all["twins"] = device_json(*devices.with_doubles);
  all["faults"] = count_faults(reports);
  for (const auto& [stem, report] : reports)
    all["ops"].push_back({{"stem", stem},
                          {"cases", report.cases},
                          {"kernels", report.kernels},
                          {"value_error", report.findings.value_error},
                          {"twin_error", report.findings.twin_error},
                          {"gradient_error", report.findings.gradient_error},
                          {"seconds", report.seconds},
                          {"faults", report.findings.faults}});
  return all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);  // drivers name themselves in any encoding
}

void check(const std::vector<std::string>& only, const CommonOptions& common) {
  expect_known(only);
  catch_interrupts();
  const CheckedDevices devices = checked_devices(Device::open(common.device));
  const OpReports reports = check_all(cases_to_run(only), devices);
  if (!common.json || !common.json->empty())
    std::fputs(terminal_text(table_text(reports_table(reports, devices)) + "\n" + faults_text(reports)).c_str(),
               stdout);
  if (common.json) write_json_result(common, check_json(reports, devices));
  std::vector<std::string> wrong;
  for (const auto& [stem, report] : reports)
    if (!report.findings.faults.empty()) wrong.push_back(stem);
  if (!wrong.empty())
    throw Error(ErrorKind::Failed,
                fmt::format("{} wrong: {}", wrong.size() == 1 ? "one op is" : fmt::format("{} ops are", wrong.size()),
                            fmt::join(wrong, ", ")),
                devices.single.info().name);
}

}  // namespace

void add_check_command(CommandLine& line) {
  auto only = std::make_shared<std::vector<std::string>>();
  line.add("check", "Whether a device computes every op rightly, and how exactly")
      .option("--only", "STEM,...", "these ops alone (conv, ssrt, ...: a kernel's file without its ending)",
              [only](const std::string& text) { *only = read_names(text, "--only"); })
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes(
          "Compares with references in plain C++, with the same kernels in double, and gradients with differences.\n"
          "Ends with exit code 1 when there is a fault.")
      .run([only](const CommonOptions& common) { check(*only, common); });
}

}  // namespace clerestory
