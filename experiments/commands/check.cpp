#include "experiments/commands/check.hpp"

#include <algorithm>
#include <cstdio>

#include "checks/kernel_check.hpp"
#include "checks/op_check.hpp"
#include "experiments/commands/check_devices.hpp"
#include "experiments/commands/check_report.hpp"
#include "experiments/commands/check_stability.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/device_verdict.hpp"
#include "host/io/config_values.hpp"
#include "host/io/json_file.hpp"
#include "host/report/progress.hpp"
#include "host/report/table.hpp"
#include "host/report/terminal.hpp"
#include "host/stopwatch.hpp"
#include "tracer/bvh.hpp"

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

/// What all cases together showed of one variant: of those that name its kernel.
struct VariantReport {
  int cases = 0;
  bool in_double = false;
  double value_ulps = NAN, gradient_ulps = NAN;
  std::vector<std::string> faults;
};
using VariantReports = std::map<KernelVariant, VariantReport>;

struct Reports {
  OpReports ops;
  VariantReports variants;
  std::string lost = {};  // the stem whose check the device did not outlive: those that would come next are left out
};

struct CheckToRun {
  std::string stem;
  std::vector<std::string> kernels;
  std::function<OpFindings(const CheckedDevices&)> run;
};

struct Options {
  std::vector<std::string> only;
  bool stability = false, quick = false;
  std::string reproduce;
  DevicesOptions devices;
};

std::vector<std::string> known_stems() {
  std::set<std::string> stems;
  for (const OpCase& c : declared_cases()) stems.insert(c.stem);
  for (const KernelCheck& c : declared_kernel_checks()) stems.insert(c.stem);
  return {stems.begin(), stems.end()};
}

void expect_known(const std::vector<std::string>& only, const std::vector<std::string>& known, const char* what) {
  for (const std::string& name : only)
    if (!std::ranges::count(known, name))
      throw usage_error(fmt::format("no such {}, the nearest is {}", what, nearest_word(name, known)), "--only", name,
                        fmt::format("{}", fmt::join(known, ", ")));
}

std::vector<std::string> kernels_of(const OpCase& c) {
  std::vector<std::string> kernels = c.kernels;
  kernels.insert(kernels.end(), c.product_kernels.begin(), c.product_kernels.end());
  return kernels;
}

long elements(const OpCase& c) {
  long sum = 0;
  for (const Tensors* tensors : {&c.inputs, &c.states})
    for (const auto& [name, tensor] : *tensors) sum += tensor.shape.count();
  return sum;
}

/// Of cases in the order of their sizes: the first that names a kernel, in each body.
class SmallestOfKernels {
 public:
  bool wants(const OpCase& c, Bodies bodies) {
    bool any = false;
    for (const std::string& kernel : bodies == Bodies::ByProducts ? c.product_kernels : c.kernels)
      any = seen_.emplace(kernel, bodies).second || any;
    return any;
  }

 private:
  std::set<std::pair<std::string, Bodies>> seen_;
};

/// Differences are what takes long: two runs for each number that is moved.
OpCase with_few_differences(OpCase c) {
  c.differences = std::min(c.differences, 4);
  return c;
}

/// All cases in all bodies of their kernels that the device can run, and the kernels that are no op's. `only` empty: of
/// all stems. Quick: the smallest case of each kernel in each body.
std::vector<CheckToRun> checks_to_run(const Options& options, const Device& device) {
  std::vector<CheckToRun> chosen;
  const auto wanted = [&](const std::string& stem) {
    return options.only.empty() || std::ranges::count(options.only, stem) > 0;
  };
  std::vector<const OpCase*> cases;
  for (const OpCase& c : declared_cases())
    if (wanted(c.stem)) cases.push_back(&c);
  if (options.quick) std::ranges::stable_sort(cases, {}, [](const OpCase* c) { return elements(*c); });
  SmallestOfKernels smallest;
  for (const OpCase* c : cases)
    for (const Bodies bodies : bodies_of(*c))
      if (can_run(device, *c, bodies) && (!options.quick || smallest.wants(*c, bodies)))
        chosen.push_back({c->stem, kernels_of(*c), [c, bodies, quick = options.quick](const CheckedDevices& d) {
                            return check_op(quick ? with_few_differences(*c) : *c, d, bodies);
                          }});
  for (const KernelCheck& c : declared_kernel_checks())
    if (wanted(c.stem))
      chosen.push_back({c.stem, c.kernels,
                        [&c, quick = options.quick](const CheckedDevices& d) { return check_kernels(c, d, quick); }});
  return chosen;
}

void add_to_variants(VariantReports& variants, const CheckToRun& check, const OpFindings& found) {
  for (const KernelVariant& variant : found.launched) {
    if (!std::ranges::count(check.kernels, variant.name)) continue;
    VariantReport& report = variants[variant];
    ++report.cases;
    report.in_double = report.in_double || found.launched_in_double.contains(variant);
    // Of several kernels that are checked together a wrong one's error is not the others'.
    if (!found.suspects.empty() && !std::ranges::count(found.suspects, variant.name)) continue;
    report.value_ulps = worse(report.value_ulps, found.value_ulps);
    report.gradient_ulps = worse(report.gradient_ulps, found.gradient_ulps);
  }
  // A kernel that cannot be built is never launched: it stands there without its defines.
  for (const std::string& suspect : found.suspects) {
    const auto named = [&](const auto& entry) {
      return entry.first.name == suspect && found.launched.contains(entry.first);
    };
    if (std::ranges::none_of(variants, named)) variants[{check.stem, suspect, {}}];
    for (auto& [variant, report] : variants)
      if (variant.name == suspect && (found.launched.contains(variant) || variant.file == check.stem))
        report.faults.insert(report.faults.end(), found.faults.begin(), found.faults.end());
  }
}

/// False after a fault that took the device with it, such as a wild address on a GPU: every later call fails.
bool answers(Device device) {
  try {
    std::int32_t word = 0;
    const Buffer buffer = device.allocate(sizeof word);
    device.zero(buffer, sizeof word);
    device.read(buffer, &word, sizeof word);
    return true;
  } catch (const Error&) {
    return false;
  }
}

Reports check_all(const std::vector<CheckToRun>& chosen, const CheckedDevices& devices) {
  Reports reports;
  Progress bar("check", static_cast<std::int64_t>(chosen.size()), "cases");
  for (const CheckToRun& each : chosen) {
    OpReport& report = reports.ops[each.stem];
    const Stopwatch watch;
    const OpFindings found = each.run(devices);
    report.seconds += watch.seconds(), ++report.cases;
    report.findings.add(found);
    for (const KernelVariant& variant : found.launched)
      if (std::ranges::count(each.kernels, variant.name)) report.kernels.insert(variant.name);
    add_to_variants(reports.variants, each, found);
    if (!found.faults.empty() && !answers(devices.single)) {
      report.findings.faults.push_back(each.stem + ": the device is lost, what comes next was not checked");
      reports.lost = each.stem;
      break;
    }
    bar.advance(each.stem);
    give_up_if_interrupted("check");
  }
  return reports;
}

/// Kernels of cases that want more work-items of a group, or more memory, than the device has.
std::set<std::string> kernels_beyond(const Device& device) {
  std::set<std::string> beyond;
  for (const OpCase& c : declared_cases()) {
    const auto is_beyond_it = [&](Bodies bodies) { return !can_run(device, c, bodies); };
    if (!has_local_memory_for(device, c, Precision::Single) || std::ranges::any_of(bodies_of(c), is_beyond_it))
      for (const std::string& kernel : kernels_of(c)) beyond.insert(kernel);
  }
  return beyond;
}

/// Programs that walk a hierarchy as GPUs do want groups, too.
bool is_beyond(const Device& device, const std::string& variant) {
  return variant.find(" BVH_STACK=") != std::string::npos && !BvhForm::short_stack().fits(device);
}

/// "tensor/pad.cl:pad_replicate GROUP=1": "pad_replicate".
std::string kernel_in(const std::string& variant) {
  const std::size_t begin = variant.find(':') + 1;
  return variant.substr(begin, variant.find(' ') - begin);
}

/// The list and what the cases launch are the same: a variant that programs launch and no case does is a hole in the
/// check. GPUs have variants of their own.
void expect_all_listed(const CheckedDevices& devices, Reports& reports) {
  if (!devices.single.info().cpu) return;
  const std::set<std::string> beyond = kernels_beyond(devices.single);
  const std::vector<std::string> listed = listed_variants();
  std::set<std::string> seen;
  for (const auto& [variant, report] : reports.variants)
    if (report.cases > 0) seen.insert(text_of(variant));
  std::vector<std::string> faults;
  for (const std::string& variant : listed)
    if (!seen.contains(variant) && !beyond.contains(kernel_in(variant)) && !is_beyond(devices.single, variant))
      faults.push_back(fmt::format("{} stands in {}, but no case of the check launches it", variant, kVariantsName));
  for (const std::string& variant : seen)
    if (!std::ranges::count(listed, variant))
      faults.push_back(fmt::format("{} is launched by the check, but does not stand in {}", variant, kVariantsName));
  if (!faults.empty()) reports.ops["variants"].findings.faults = faults;
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
std::string check_json(const Reports& reports, const CheckedDevices& devices) {
  nlohmann::ordered_json all = devices_json(devices);
  all["faults"] = all_faults(reports.ops).size();
  if (!reports.lost.empty()) all["lost"] = reports.lost;
  for (const auto& [stem, report] : reports.ops)
    all["ops"].push_back({{"stem", stem},
                          {"cases", report.cases},
                          {"kernels", report.kernels},
                          {"value_error", report.findings.value_error},
                          {"twin_error", report.findings.twin_error},
                          {"gradient_error", report.findings.gradient_error},
                          {"value_ulps", report.findings.value_ulps},
                          {"gradient_ulps", report.findings.gradient_ulps},
                          {"seconds", report.seconds},
                          {"faults", report.findings.faults}});
  for (const auto& [variant, report] : reports.variants)
    all["kernels"].push_back({{"kernel", text_of(variant)},
                              {"cases", report.cases},
                              {"in_double", report.in_double},
                              {"value_ulps", report.value_ulps},
                              {"gradient_ulps", report.gradient_ulps},
                              {"faults", report.faults}});
  return json_text(all);
}

void check_ops(const CheckedDevices& devices, const Options& options, const CommonOptions& common) {
  Reports reports = check_all(checks_to_run(options, devices.single), devices);
  if (options.only.empty() && !options.quick && reports.lost.empty()) expect_all_listed(devices, reports);
  if (!common.json || !common.json->empty())
    std::fputs(
        terminal_text(table_text(reports_table(reports.ops, devices)) + "\n" + faults_text(all_faults(reports.ops)))
            .c_str(),
        stdout);
  if (common.json) write_json_result(common, check_json(reports, devices));
  std::vector<std::string> wrong;
  for (const auto& [stem, report] : reports.ops)
    if (!report.findings.faults.empty()) wrong.push_back(stem);
  expect_none_wrong("op", wrong, devices);
}

void check(const Options& options, const CommonOptions& common) {
  catch_interrupts();
  if (!options.devices.from.empty()) return show_devices(options.devices, common);
  if (!options.reproduce.empty()) return reproduce_fault(options.reproduce, common);
  if (options.stability)
    expect_known(options.only, stability_groups(), "group");
  else
    expect_known(options.only, known_stems(), "op");
  if (common.device == "all") {
    if (options.stability) throw usage_error("asks one device", "--stability", "--device all", "--device NAME");
    DevicesOptions devices = options.devices;
    if (!(devices.patience > 0 && devices.patience <= 1e4))
      throw usage_error("out of range", "--patience", fmt::format("{}", devices.patience), "0 to 10000 minutes");
    devices.only = options.only.empty() ? known_stems() : options.only;
    devices.all = options.only.empty(), devices.quick = options.quick;
    return check_devices(devices, common);
  }
  if (!options.devices.report.empty())
    throw usage_error("is written of all devices", "--report", options.devices.report.string(),
                      "--device all, or --from");
  for (const char* option : {"--patience", "--again"})
    if (was_given(common, option)) throw usage_error("is for all devices", option, "", "--device all beside it");
  if (options.stability && options.quick)
    throw usage_error("is for ops", "--quick", "beside --stability", "one of them");
  const CheckedDevices devices = checked_devices(Device::open(common.device));
  if (options.stability)
    check_stability_of(devices, options.only, common);
  else
    check_ops(devices, options, common);
}

}  // namespace

void add_check_command(CommandLine& line) {
  auto options = std::make_shared<Options>();
  line.add("check", "Whether a device computes every op rightly, and how exactly")
      .flag("--quick", "the smallest case of each kernel alone: for devices that are slow, simulators above all",
            options->quick)
      .option("--report", "FILE", "with --device all: kernels by devices, as FILE.html or FILE.md",
              options->devices.report)
      .option("--from", "FILE,...", "what --device all wrote by --json, shown again; nothing is checked",
              [options](const std::string& text) { options->devices.from = read_names(text, "--from"); })
      .option("--patience", "MINUTES",
              "with --device all: a driver that launches nothing for so long is ended, and its kernel is wrong",
              options->devices.patience)
      .flag("--again", "with --device all: check devices anew whose verdict is kept", options->devices.again)
      .option("--reproduce", "FILE", "whether the device shows the fault of a short kernel (checks/reproducers)",
              options->reproduce)
      .flag("--stability", "stiff and extreme cases instead: finite? how far from double?", options->stability)
      .option("--only", "NAME,...",
              "these ops alone (conv, ssrt, ...: a kernel's file without its ending); with --stability: these groups",
              [options](const std::string& text) { options->only = read_names(text, "--only"); })
      .common({Common::Device, Common::Json, Common::Quiet})
      .notes(
          "Compares with references in plain C++, with the same kernels in double, and gradients with differences;\n"
          "with --stability whole small graphs in float with the same in double (docs/stability.md).\n"
          "--device all: every device, each in a process of its own; a verdict is kept until the driver, the program,\n"
          "its kernels or what the environment says to either change (docs/devices.md).\n"
          "Ends with exit code 1 when there is a fault.")
      .run([options](const CommonOptions& common) { check(*options, common); });
}

}  // namespace clerestory
