#include "experiments/bench/tune_trials.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/cl/disk_cache.hpp"
#include "host/io/json_file.hpp"
#include "host/ops/nn/clblast_parameters.hpp"

namespace clerestory {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kind = "tune";
constexpr const char* form = "1";  // of what is kept, and of the products that sets are measured by

/// Of each kernel that copies, how its parameters begin; PADTRA_ stands before PAD_.
constexpr std::array<std::pair<const char*, const char*>, 4> copying{
    {{"Copy", "COPY_"}, {"Transpose", "TRA_"}, {"Padtranspose", "PADTRA_"}, {"Pad", "PAD_"}}};

ClblastValues joined_copies(const ClblastParameters& own) {
  ClblastValues all;
  for (const auto& [kernel, prefix] : copying) all.insert(own.at(kernel).begin(), own.at(kernel).end());
  return all;
}

void add(ClblastParameters& to, const std::string& kernel, const ClblastValues& values) {
  if (kernel != "Copies") {
    to[kernel] = values;
    return;
  }
  for (const auto& [name, value] : values)
    for (const auto& [copy, prefix] : copying)
      if (name.starts_with(prefix)) to[copy][name] = value;
}

}  // namespace

TuneTrials::TuneTrials(Device device, bool again)
    : key_(fmt::format("{}\nCLBlast {}\n{}", device.fingerprint(), clblast_version(), form)),
      own_(clblast_defaults(device)),
      searches_{{{"Xgemm", own_.at("Xgemm"), {}},
                 {"XgemmDirect", own_.at("XgemmDirect"), {}},
                 {"Copies", joined_copies(own_), {}}}} {
  const auto kept = DiskCache().load(kind, key_);
  if (again || !kept) return;
  const Json json = Json::parse(*kept);  // whole: the cache has a checksum of it
  for (ClblastSearch& s : searches_)
    for (const Json& trial : json.at(s.kernel))
      s.trials.push_back({trial.at("values").get<ClblastValues>(), trial.at("gain").get<double>(),
                          trial.at("least").get<double>(), trial.at("fault").get<std::string>()});
  json.at("running").get_to(running_);
  json.at("times").get_to(times_);
  if (times_ < 2) return;
  for (const auto& [kernel, values] : running_)
    search(kernel).trials.push_back({values, 0, 0, "the process ended twice while it was measured"});
  end();
}

ClblastSearch& TuneTrials::search(const std::string& kernel) {
  return *std::ranges::find(searches_, kernel, &ClblastSearch::kernel);
}

int TuneTrials::sets() const {
  std::size_t count = 0;
  for (const ClblastSearch& s : searches_) count += s.trials.size();
  return static_cast<int>(count);
}

void TuneTrials::begin(const ClblastSets& sets) {
  times_ = sets == running_ ? times_ + 1 : 1;
  running_ = sets;
  save();
}

void TuneTrials::end() {
  running_.clear();
  times_ = 0;
  save();
}

ClblastParameters TuneTrials::parameters(const ClblastSets& tried) const {
  ClblastParameters result;
  for (const ClblastSearch& s : searches_) {
    const auto own = tried.find(s.kernel);
    add(result, s.kernel, own != tried.end() ? own->second : s.best());
  }
  std::erase_if(result, [&](const auto& kernel) { return own_.at(kernel.first) == kernel.second; });
  return result;
}

void TuneTrials::save() const {
  Json json{{"running", running_}, {"times", times_}};
  for (const ClblastSearch& s : searches_) {
    json[s.kernel] = Json::array();
    for (const ClblastTrial& trial : s.trials)
      json[s.kernel].push_back(
          {{"values", trial.values}, {"gain", trial.gain}, {"least", trial.least}, {"fault", trial.fault}});
  }
  DiskCache().store(kind, key_, json_text(json, -1));
}

}  // namespace clerestory
