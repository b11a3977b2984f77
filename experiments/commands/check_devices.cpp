#include "experiments/commands/check_devices.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/commands/device_verdict.hpp"
#include "experiments/commands/verdict_tables.hpp"
#include "host/cl/reproducer.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Prints, writes, and judges.
void conclude(const Json& all, const DevicesOptions& options, const CommonOptions& common) {
  const Totals totals = totals_of(all);
  if (!options.report.empty()) write_report(options.report, all, common);
  if (common.json) write_json_result(common, json_text(all));
  if (!common.json || !common.json->empty()) {
    std::string text = table_text(devices_table(all)) + "\n";
    for (const Json& verdict : all.at("devices"))
      for (const Json& failure : verdict.at("failures"))
        text += fmt::format("{}: {}: {}{}\n", label_of(verdict), failure.at("kernel").get<std::string>(),
                            failure.at("fault").get<std::string>(),
                            failure.at("explained").is_null()
                                ? ""
                                : fmt::format(" (shown by {})", failure.at("explained").get<std::string>()));
    std::fputs(terminal_text(text + totals_text(totals)).c_str(), stdout);
    std::fflush(stdout);
  }
  if (!totals.at_fault.empty())
    throw Error(ErrorKind::Failed, fmt::format("kernels are wrong on {}", fmt::join(totals.at_fault, ", ")));
  if (totals.refused == totals.devices)
    throw Error(ErrorKind::Failed,
                "no kernel was checked: every device is refused, by its driver's fault or by one of tensor/probe.cl");
}

bool is_same_device(const Json& a, const Json& b) {
  for (const char* key : {"index", "name", "platform", "driver", "less", "told"})
    if (a.at("device").value(key, Json("")) != b.at("device").value(key, Json(""))) return false;
  return true;
}

/// What one device showed in several checks, each of some ops (--only): all of their kernels, the worse state.
void join(Json& verdict, const Json& further) {
  std::set<std::string> known;
  for (const Json& kernel : verdict.at("kernels")) known.insert(kernel.at("kernel"));
  for (const Json& kernel : further.at("kernels"))
    if (!known.contains(kernel.at("kernel"))) verdict["kernels"].push_back(kernel);
  for (const Json& failure : further.at("failures"))
    if (std::ranges::find(verdict.at("failures"), failure) == verdict.at("failures").end())
      verdict["failures"].push_back(failure);
  if (verdict.at("state") == "right") verdict["state"] = further.at("state");
  verdict["quick"] = verdict.value("quick", false) || further.value("quick", false);
}

Json read_result(const std::string& file) {
  try {
    const std::string text = read_file(file);
    parse_json_object(text, file);  // says better what is wrong with it
    Json all = Json::parse(text);
    totals_of(all), devices_table(all), kernels_table(all), failures_table(all);
    return all;
  } catch (const nlohmann::json::exception& error) {
    throw usage_error(error.what(), "--from", file, "what check --device all --json=FILE wrote");
  }
}

}  // namespace

void check_devices(const DevicesOptions& options, const CommonOptions& common) {
  expect_report_name(options.report);
  const std::vector<DeviceInfo> devices = list_devices();
  if (devices.empty()) throw Error(ErrorKind::Device, why_no_device());
  Json all{{"program", this_build().commit}, {"kernels_hash", kernels_hash()}, {"devices", Json::array()}};
  Progress bar("check", static_cast<std::int64_t>(devices.size()), "devices");
  for (const DeviceInfo& info : devices) {
    all["devices"].push_back(verdict_on(info, options));
    bar.advance(info.name);
    give_up_if_interrupted("check");
  }
  conclude(all, options, common);
}

void show_devices(const DevicesOptions& options, const CommonOptions& common) {
  expect_report_name(options.report);
  Json all;
  all["devices"] = Json::array();
  for (const std::string& file : options.from) {
    const Json result = read_result(file);
    for (const Json& verdict : result.at("devices")) {
      Json& devices = all["devices"];
      const auto same =
          std::ranges::find_if(devices, [&](const Json& known) { return is_same_device(known, verdict); });
      if (same == devices.end())
        devices.push_back(verdict);
      else
        join(*same, verdict);
    }
  }
  conclude(all, options, common);
}

void reproduce_fault(const fs::path& file, const CommonOptions& common) {
  if (common.device.empty()) throw usage_error("on which device?", "--reproduce", "no --device", "--device NUMBER");
  int index = 0;
  read_value(common.device, "--device", index);
  const std::string shown = shown_by(read_file(file), index);
  if (!shown.empty()) throw Error(ErrorKind::Failed, "the device shows it: " + shown, file.string());
  std::puts("the device does not show it");
}

}  // namespace clerestory
