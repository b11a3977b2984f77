#include "experiments/weights/average.hpp"

#include <algorithm>

#include "experiments/weights/maps_text.hpp"
#include "host/error.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {
namespace {

bool is_same(const Leg& a, const Leg& b) {
  return a.started == b.started && a.config_hash == b.config_hash && a.seed == b.seed;
}

std::string size_text(Size size) { return fmt::format("{}x{}", size.width, size.height); }

void check_alike(const LoadedWeights& first, const LoadedWeights& other, const std::string& where) {
  const auto must_agree = [&](const char* what, const std::string& found, const std::string& expected) {
    if (found != expected) throw usage_error(fmt::format("weights of another {}", what), where, found, expected);
  };
  must_agree("net", net_text(other.net), net_text(first.net));
  must_agree("size of view", size_text(other.size), size_text(first.size));
  if (!is_same(other.history.legs.front(), first.history.legs.front()))
    throw usage_error("these weights go back to another first leg", where, other.history.legs.front().started,
                      first.history.legs.front().started);
}

LoadedWeights load_trained(const std::filesystem::path& file, const Device& device) {
  LoadedWeights loaded = load_weights(file, device);
  if (loaded.history.legs.empty()) throw usage_error("the file says nothing of its training", file.string());
  return loaded;
}

/// Puts the legs of `more` among those of `all`.
void merge(History& all, const History& more) {
  for (const Leg& leg : more.legs) {
    const auto same = std::ranges::find_if(all.legs, [&](const Leg& l) { return is_same(l, leg); });
    if (same == all.legs.end())
      all.legs.push_back(leg);
    else if (leg.steps > same->steps)
      *same = leg;
  }
  std::ranges::stable_sort(all.legs, {}, &Leg::started);
}

Leg averaging(const LoadedWeights& weights, const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files)
    names.push_back(fmt::format("{} ({})", file.filename().string(), record_file(file).hash));
  Leg leg;
  leg.experiment = "average", leg.preset = weights.preset;
  leg.width = weights.size.width, leg.height = weights.size.height;
  leg.commit = this_build().commit, leg.started = utc_now(), leg.seed = weights.history.legs.back().seed;
  leg.init = fmt::format("mean of {}", fmt::join(names, ", "));
  return leg;
}

}  // namespace

LoadedWeights average_weights(const std::vector<std::filesystem::path>& files, Device device) {
  if (files.size() < 2) throw usage_error("a mean is of two files or more", "FILE", fmt::format("{}", files.size()));
  LoadedWeights mean = load_trained(files.front(), device);
  std::map<std::string, std::vector<double>> sums;
  for (const auto& [name, shape] : maps_states(mean.net)) sums[name] = mean.states->get(name).real;
  for (std::size_t i = 1; i < files.size(); ++i) {
    const LoadedWeights other = load_trained(files[i], device);
    check_alike(mean, other, files[i].string());
    for (auto& [name, sum] : sums) {
      const Tensor more = other.states->get(name);
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += more.real[k];
    }
    merge(mean.history, other.history);
    mean.means = other.means;
  }
  for (auto& [name, sum] : sums) {
    Tensor tensor = mean.states->get(name);
    for (std::size_t k = 0; k < sum.size(); ++k) tensor.real[k] = sum[k] / static_cast<double>(files.size());
    mean.states->set(name, tensor);
  }
  mean.history.legs.push_back(averaging(mean, files));
  return mean;
}

}  // namespace clerestory
