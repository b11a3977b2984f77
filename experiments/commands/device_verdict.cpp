#include "experiments/commands/device_verdict.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/cl/disk_cache.hpp"
#include "host/cl/reproducer.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/child_process.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "host/report/temporary_folder.hpp"
#include "host/stopwatch.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

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

}  // namespace

std::vector<std::string> listed_variants() {
  std::istringstream lines(read_file(found_data(kVariantsName)));
  std::vector<std::string> listed;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty() && !line.starts_with("#")) listed.push_back(line);
  return listed;
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

}  // namespace clerestory
