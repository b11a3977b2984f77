#include "experiments/commands/check_devices.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "experiments/commands/check_report.hpp"
#include "host/cl/device.hpp"
#include "host/cl/disk_cache.hpp"
#include "host/cl/reproducer.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/child_process.hpp"
#include "host/report/html.hpp"
#include "host/report/progress.hpp"
#include "host/report/table.hpp"
#include "host/report/temporary_folder.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// --- Files beside the program
// -----------------------------------------------------------------------------------------

/// A short kernel that shows a driver's fault without any of ours: "// device: NAME" is part of the device's or its
/// platform's name, "// kernels: FILE.cl,..." what fails by it, or "all" where the device is refused.
struct Reproducer {
  fs::path file;
  std::string device;
  std::vector<std::string> kernels;
};

std::string header_of(const std::string& source, const std::string& key) {
  std::istringstream lines(source);
  for (std::string line; std::getline(lines, line) && line.starts_with("//");)
    if (const std::string start = "// " + key + ": "; line.starts_with(start)) return line.substr(start.size());
  return {};
}

std::vector<Reproducer> reproducers() {
  std::vector<Reproducer> found;
  const fs::path folder = found_data("checks/reproducers");
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".cl") continue;
    const std::string source = read_file(entry.path()), device = header_of(source, "device"),
                      kernels = header_of(source, "kernels");
    if (device.empty() || kernels.empty())
      throw usage_error("does not say what it is for", entry.path().string(), {},
                        "lines \"// device: NAME\" and \"// kernels: FILE.cl,... or all\" at its start");
    found.push_back({fs::absolute(entry.path()), device, read_names(kernels, "kernels")});
  }
  std::ranges::sort(found, {}, &Reproducer::file);
  return found;
}

// --- One device
// -------------------------------------------------------------------------------------------------------

/// This program again.
std::string program() { return fs::read_symlink("/proc/self/exe").string(); }

bool ended_by_signal(const ChildResult& child) { return child.status >= 128; }

std::string last_line(const std::string& text) {
  std::istringstream lines(text);
  std::string last;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty()) last = line;
  return last;
}

/// Whether a child still does something: it launches kernels, and CLERESTORY_LAUNCHES grows.
class Silence {
 public:
  Silence(fs::path launches, double minutes) : launches_(std::move(launches)), most_(minutes * 600) {}

  /// Asked ten times a second: time in which all is stopped does not count.
  bool is_bearable() {
    std::error_code none;
    const auto size = fs::file_size(launches_, none);
    asked_ = std::exchange(size_, none ? 0 : size) == size_ ? asked_ + 1 : 0;
    return !too_long();
  }
  bool too_long() const { return asked_ > most_; }
  std::string last_launched() const { return size_ > 0 ? last_line(read_file(launches_)) : ""; }

 private:
  fs::path launches_;
  double most_, asked_ = 0;
  std::uintmax_t size_ = 0;
};

/// What Intel's driver is told by the environment: "CL_CONFIG_CPU_TARGET_ARCH=core-avx2".
std::string told() {
  std::vector<std::string> words;
  for (const auto& [name, value] : begin_provenance({}).environment)
    if (name.starts_with("CL_CONFIG_")) words.push_back(name + "=" + value);
  return fmt::format("{}", fmt::join(words, " "));
}

/// `less`: what the device is pretended to be without, CLERESTORY_PRETEND.
Json info_json(const DeviceInfo& info) {
  const char* less = std::getenv("CLERESTORY_PRETEND");
  return {{"index", info.index},
          {"name", info.name},
          {"platform", info.platform},
          {"driver", info.driver},
          {"compute_units", info.compute_units},
          {"fp64", info.fp64},
          {"less", less != nullptr ? less : ""},
          {"told", told()}};
}

/// Makes the verdict on one device:
/// {device, quick, state: right | wrong | refused, why, kernels: [{kernel, cases, in_double, value_ulps, gradient_ulps,
/// faults}], failures: [{kernel, fault, explained}], seconds}.
class Verdict {
 public:
  Verdict(const DeviceInfo& info, const DevicesOptions& options) : info_(info), options_(options) {}

  Json make() {
    const Stopwatch watch;
    run(options_.only);
    if (state_ == "right" && !failures_.empty()) state_ = "wrong";
    explain();
    Json kernels = Json::array();
    for (const auto& [name, kernel] : kernels_) kernels.push_back(kernel);
    return {{"device", info_json(info_)}, {"quick", options_.quick}, {"state", state_},           {"why", why_},
            {"kernels", kernels},         {"failures", failures_},   {"seconds", watch.seconds()}};
  }

 private:
  /// In one process; where that ends by a signal, op by op, and where the device is lost, with those that come next in
  /// another: the others are checked all the same.
  void run(const std::vector<std::string>& stems) {
    const std::string launches = (scratch_ / "launches").string();
    fs::remove(launches);
    std::vector<std::string> arguments{"env",      "CLERESTORY_LAUNCHES=" + launches, program(), "check",
                                       "--device", std::to_string(info_.index),       "--json",  "--quiet"};
    if (options_.quick) arguments.push_back("--quick");
    if (stems.size() < options_.only.size() || !options_.all)
      arguments.insert(arguments.end(), {"--only", fmt::format("{}", fmt::join(stems, ","))});
    Silence silence(launches, options_.patience);
    const ChildResult child = run_child(arguments, "", [&] { return silence.is_bearable(); });
    give_up_if_interrupted("check");
    // A driver that crashes when all is said (Oclgrind does) has done its work.
    if (const Json found = Json::parse(child.out, nullptr, false); !found.is_discarded()) {
      read(found);
      if (found.contains("lost")) run_rest(stems, found);
      return;
    }
    if (ended_by_signal(child)) {
      if (stems.size() == 1) return lost(stems[0], child, silence);
      for (const std::string& stem : stems) run({stem});
      return;
    }
    if (child.status != static_cast<int>(ErrorKind::Device))
      throw Error(ErrorKind::Failed, "check ends with exit code " + std::to_string(child.status), info_.name,
                  child.errors);
    state_ = "refused", why_ = last_line(child.errors);
    failures_.push_back({{"kernel", "all"}, {"fault", why_}});
  }

  /// What the device was lost before. Nobody is asked again who was not answered.
  void run_rest(const std::vector<std::string>& stems, const Json& found) {
    std::vector<std::string> rest;
    for (const std::string& stem : stems)
      if (std::ranges::none_of(found["ops"], [&](const Json& op) { return op["stem"] == stem; })) rest.push_back(stem);
    if (!rest.empty() && rest.size() < stems.size()) run(rest);
  }

  void lost(const std::string& stem, const ChildResult& child, const Silence& silence) {
    const std::string how = silence.too_long() ? fmt::format("has done nothing for {} minutes", options_.patience)
                                               : fmt::format("ends the process by signal {}", child.status - 128);
    const std::string last = silence.last_launched();
    failures_.push_back({{"kernel", last.empty() ? stem : last},
                         {"fault", fmt::format("{}: the driver {}{}", stem, how, said_of(child))}});
  }
  static std::string said_of(const ChildResult& child) {
    const std::string last = last_line(child.errors);
    return last.empty() ? "" : ": " + last;
  }

  void read(const Json& found) {
    if (found.contains("kernels"))
      for (const Json& kernel : found["kernels"]) {
        kernels_.emplace(kernel["kernel"], kernel);
        if (!kernel["faults"].empty())
          failures_.push_back({{"kernel", kernel["kernel"]}, {"fault", kernel["faults"][0]}});
      }
    for (const Json& op : found["ops"])
      if (op["stem"] == "variants")
        for (const Json& fault : op["faults"]) failures_.push_back({{"kernel", "none"}, {"fault", fault}});
  }

  void explain() {
    const std::string names = info_.name + "\n" + info_.platform;
    for (Json& failure : failures_) failure["explained"] = nullptr;
    for (const Reproducer& r : reproducers()) {
      if (names.find(r.device) == std::string::npos) continue;
      std::vector<Json*> by_it;
      for (Json& failure : failures_) {
        const std::string kernel = failure["kernel"];
        if (failure["explained"].is_null() && std::ranges::any_of(r.kernels, [&](const std::string& k) {
              return kernel == k || kernel.starts_with(k + ":");
            }))
          by_it.push_back(&failure);
      }
      if (by_it.empty() || !shown(r)) continue;
      for (Json* failure : by_it) (*failure)["explained"] = r.file.filename().string();
    }
  }
  bool shown(const Reproducer& r) const {
    Silence silence({}, options_.patience);  // one that hangs shows it
    const ChildResult child = run_child(
        {program(), "check", "--device", std::to_string(info_.index), "--quiet", "--reproduce", r.file.string()}, "",
        [&] { return silence.is_bearable(); });
    return child.out.empty() && (ended_by_signal(child) || child.status == static_cast<int>(ErrorKind::Failed));
  }

  const DeviceInfo& info_;
  const DevicesOptions& options_;
  const TemporaryFolder scratch_;
  std::string state_ = "right", why_;
  std::map<std::string, Json> kernels_;
  std::vector<Json> failures_;
};

// --- Kept verdicts
// ----------------------------------------------------------------------------------------------------

/// All that a verdict hangs on: device, driver and compiler, of all devices where another runs the twins in double;
/// this program, its kernels, the list of variants and the reproducers; what the environment says.
std::string key_of(const DeviceInfo& info, const DevicesOptions& options) {
  const std::vector<std::string> fingerprints = device_fingerprints();
  std::string key = fmt::format("{} {}\n{}\n{}\n{}\n{} {} {}\n", info.index,
                                info.fp64 ? fingerprints.at(static_cast<std::size_t>(info.index))
                                          : fmt::format("{}", fmt::join(fingerprints, "\n")),
                                file_hash("/proc/self/exe"), kernels_hash(), fmt::join(listed_variants(), "\n"),
                                options.quick ? "quick" : "", options.patience, fmt::join(options.only, ","));
  for (const Reproducer& r : reproducers()) key += r.file.filename().string() + " " + file_hash(r.file) + "\n";
  for (const auto& [name, value] : begin_provenance({}).environment) key += name + "=" + value + "\n";
  return key;
}

Json verdict_on(const DeviceInfo& info, const DevicesOptions& options) {
  const DiskCache cache;
  const std::string key = key_of(info, options);
  if (!options.again)
    if (const auto kept = cache.load("verdict", key)) {
      Json verdict = Json::parse(*kept);
      verdict["device"] = info_json(info), verdict["kept"] = true;
      return verdict;
    }
  Json verdict = Verdict(info, options).make();
  cache.store("verdict", key, json_text(verdict));
  verdict["kept"] = false;
  return verdict;
}

// --- What is shown
// ----------------------------------------------------------------------------------------------------

struct Totals {
  std::set<std::string> kernels;
  std::size_t devices = 0, refused = 0, failed = 0, unexplained = 0;
  std::vector<std::string> at_fault;  // devices that programs would use
};

Totals totals_of(const Json& all) {
  Totals t;
  for (const Json& verdict : all.at("devices")) {
    ++t.devices;
    for (const Json& kernel : verdict.at("kernels")) t.kernels.insert(kernel.at("kernel"));
    for (const Json& failure : verdict.at("failures")) ++t.failed, t.unexplained += failure.at("explained").is_null();
    if (verdict.at("state") == "wrong") t.at_fault.push_back(verdict.at("device").at("name"));
    t.refused += verdict.at("state") == "refused";
  }
  return t;
}

std::string totals_text(const Totals& t) {
  return fmt::format("kernels {} devices {} failed {} unexplained {}\n", t.kernels.size(), t.devices, t.failed,
                     t.unexplained);
}

/// Right, wrong or refused, and what that goes by.
std::string state_of(const Json& verdict) {
  return verdict.at("state").get<std::string>() + (verdict.value("quick", false) ? ", smallest cases alone" : "") +
         (verdict.value("kept", false) ? ", as checked before" : "");
}

std::string label_of(const Json& verdict) {
  const Json& device = verdict.at("device");
  std::string label =
      fmt::format("{} ({})", device.at("name").get<std::string>(), device.at("platform").get<std::string>());
  for (const char* with : {"less", "told"})
    if (const std::string what = device.value(with, ""); !what.empty()) label += " with " + what;
  return label;
}

/// The largest of a column, with the kernel that has it.
std::pair<double, std::string> worst_of(const Json& verdict, const char* column) {
  std::pair<double, std::string> worst{NAN, ""};
  for (const Json& kernel : verdict.at("kernels")) {
    if (!kernel.at(column).is_number() || !kernel.at("faults").empty()) continue;
    const double ulps = kernel.at(column);
    if (!(ulps <= worst.first)) worst = {ulps, kernel.at("kernel")};
  }
  return worst;
}

Table devices_table(const Json& all) {
  Table table;
  table.title = "Devices";
  table.note =
      "Errors of float in epsilons (1.2e-7) of the largest number of an output: of values from a reference in plain "
      "C++ "
      "and from the same kernel in double, of gradients from those in double; the worst of all kernels that are right.";
  for (const char* name : {"device", "driver", "state", "kernels", "in double"})
    table.columns.push_back({name, "", Best::None, 3});
  for (const char* name : {"worst value", "worst gradient"}) table.columns.push_back({name, "epsilon", Best::None, 3});
  for (const char* name : {"failed", "explained"}) table.columns.push_back({name, "", Best::None, 3});
  for (const Json& verdict : all.at("devices")) {
    long doubles = 0, explained = 0;
    for (const Json& kernel : verdict.at("kernels")) doubles += kernel.at("in_double").get<bool>();
    for (const Json& failure : verdict.at("failures")) explained += !failure.at("explained").is_null();
    const auto worst = [&](const char* column) {
      const double ulps = worst_of(verdict, column).first;
      return std::isnan(ulps) ? Cell() : Cell(Measure{ulps});
    };
    table.add({label_of(verdict), verdict.at("device").at("driver").get<std::string>(), state_of(verdict),
               fmt::format("{}", verdict.at("kernels").size()), fmt::format("{}", doubles), worst("value_ulps"),
               worst("gradient_ulps"), fmt::format("{}", verdict.at("failures").size()), fmt::format("{}", explained)});
  }
  return table;
}

/// A row a variant, of each device the errors of its value and gradient.
Table kernels_table(const Json& all) {
  Table table;
  table.title = "Kernels";
  table.note = "Of each device: error of the value / of the gradient in epsilons; - : nothing to compare.";
  table.columns.push_back({"kernel and defines", "", Best::None, 3});
  std::map<std::string, std::vector<Cell>> rows;
  std::size_t column = 0;
  for (const Json& verdict : all.at("devices")) {
    if (verdict.at("kernels").empty()) continue;
    table.columns.push_back({label_of(verdict), "epsilon", Best::None, 3});
    ++column;
    for (const Json& kernel : verdict.at("kernels")) {
      std::vector<Cell>& row = rows[kernel.at("kernel")];
      row.resize(column);
      const auto text = [](const Json& ulps) {
        return ulps.is_number() ? fmt::format("{:.3g}", ulps.get<double>()) : "-";
      };
      row.back() = kernel.at("faults").empty()
                       ? fmt::format("{} / {}", text(kernel.at("value_ulps")), text(kernel.at("gradient_ulps")))
                       : std::string("FAULT");
    }
  }
  for (auto& [kernel, row] : rows) {
    row.resize(column);
    row.insert(row.begin(), kernel);
    table.add(row);
  }
  return table;
}

Table failures_table(const Json& all) {
  Table table;
  table.title = "What failed";
  for (const char* name : {"device", "kernel", "fault", "shown by"}) table.columns.push_back({name, "", Best::None, 3});
  for (const Json& verdict : all.at("devices"))
    for (const Json& failure : verdict.at("failures"))
      table.add({label_of(verdict), failure.at("kernel").get<std::string>(), failure.at("fault").get<std::string>(),
                 failure.at("explained").is_null()
                     ? Cell("nothing: unexplained")
                     : Cell("checks/reproducers/" + failure.at("explained").get<std::string>())});
  return table;
}

std::string markdown_of(const Json& all) {
  const Table failures = failures_table(all);
  return fmt::format(
      "# Devices\n\nWhat `clerestory check --device all` found on drivers that can be had without their hardware, "
      "written by\nits `--report` (`tests/devices.sh` sets drivers up). The last line: kernel variants, devices, "
      "failures "
      "(pairs of both, or a\ndevice refused), and those that no [reproducer](../checks/reproducers) shows.\n\n"
      "{}\n{}{}\n{}",
      table_markdown(devices_table(all)), failures.rows.empty() ? "" : table_markdown(failures) + "\n",
      table_markdown(kernels_table(all)), totals_text(totals_of(all)));
}

/// Before the work.
void expect_report_name(const fs::path& file) {
  if (!file.empty() && file.extension() != ".md" && file.extension() != ".html")
    throw usage_error("neither a page nor Markdown", "--report", file.string(), "FILE.html or FILE.md");
  if (!file.empty()) AtomicFile tried(file);  // hours go by before it is written
}

void write_report(const fs::path& file, const Json& all, const CommonOptions& common) {
  if (file.extension() == ".md") return write_file(file, markdown_of(all));
  HtmlReport page("Kernels on devices", totals_text(totals_of(all)));
  page.section("Devices").table(devices_table(all));
  if (const Table failures = failures_table(all); !failures.rows.empty()) page.section("What failed").table(failures);
  page.section("Kernels").table(kernels_table(all));
  page.footer(begin_provenance(common.command)).write(file);
}

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

std::vector<std::string> listed_variants() {
  std::istringstream lines(read_file(found_data(kVariantsName)));
  std::vector<std::string> listed;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty() && !line.starts_with("#")) listed.push_back(line);
  return listed;
}

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
