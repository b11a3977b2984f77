#include "experiments/training/checkpoint.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/metadata.hpp"
#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr const char* progress_tensor = "training.progress";

void must_agree(const TensorFile& file, const std::string& key, const std::string& expected, const std::string& where) {
  if (fact(file, key, where) != expected)
    throw usage_error("the checkpoint belongs to another run", where + ": " + key, fact(file, key, where), expected);
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const States& states, const TrainingProgress& p,
                      const RunIdentity& identity) {
  TensorFile file;
  for (const std::string& name : states.names())
    if (!is_frozen_feature(name)) file.tensors[name] = stored_state(states, name);
  std::vector<std::uint64_t> words{static_cast<std::uint64_t>(p.step), std::bit_cast<std::uint64_t>(p.seconds),
                                   std::bit_cast<std::uint64_t>(p.best_score), static_cast<std::uint64_t>(p.summed)};
  for (const double sum : p.loss_sums) words.push_back(std::bit_cast<std::uint64_t>(sum));
  const long count = static_cast<long>(words.size());
  file.tensors[progress_tensor] = StoredTensor({count}, std::move(words));
  if (p.means) p.means->store(file);
  store_moments(file, p.kept);
  file.metadata["kind"] = "checkpoint";
  file.metadata["preset"] = identity.preset;
  file.metadata["width"] = std::to_string(identity.size.width),
  file.metadata["height"] = std::to_string(identity.size.height);
  file.metadata["net"] = identity.net;
  file.metadata["seed"] = std::to_string(identity.seed);
  file.metadata["config_hash"] = identity.config_hash;
  file.metadata["views_hash"] = fmt::format("{:016x}", identity.views_hash);
  file.metadata["step"] = std::to_string(p.step);
  file.metadata[kEarlierSteps] = std::to_string(p.moment_steps);
  file.metadata["history"] = history_json(p.history);
  write_safetensors(path, file);
}

TrainingProgress go_on_from(const TensorFile& file, const std::string& where, States& states,
                            const RunIdentity& identity) {
  must_agree(file, "kind", "checkpoint", where);
  must_agree(file, "net", identity.net, where);
  must_agree(file, "width", std::to_string(identity.size.width), where);
  must_agree(file, "height", std::to_string(identity.size.height), where);
  must_agree(file, "seed", std::to_string(identity.seed), where);
  must_agree(file, "config_hash", identity.config_hash, where);
  if (fact(file, "views_hash", where) != fmt::format("{:016x}", identity.views_hash))
    throw usage_error(
        "the training views are not those that the run began with", where, fact(file, "views_hash", where),
        fmt::format("{:016x}; put the data set back, or begin anew with another run.variant", identity.views_hash));
  for (const std::string& name : states.names())
    if (!is_frozen_feature(name)) set_state(states, name, states.view(name).shape, file, where);

  const auto& words = file.get(progress_tensor, where).words(where);
  if (words.size() < 4) throw usage_error("the checkpoint's progress is cut short", where);
  TrainingProgress p;
  p.step = static_cast<std::int64_t>(words[0]);
  p.seconds = std::bit_cast<double>(words[1]), p.best_score = std::bit_cast<double>(words[2]);
  p.summed = static_cast<std::int64_t>(words[3]);
  for (std::size_t i = 4; i < words.size(); ++i) p.loss_sums.push_back(std::bit_cast<double>(words[i]));
  must_agree(file, "step", std::to_string(p.step), where);
  const auto finite = [](double v) { return std::isfinite(v); };
  if (p.step < 0 || p.summed < 0 || p.summed > p.step || !(p.seconds >= 0 && finite(p.seconds)) ||
      !finite(p.best_score) || !std::ranges::all_of(p.loss_sums, finite))
    throw usage_error(
        "the checkpoint's progress makes no sense", where,
        fmt::format("step {}, {} s, best score {}, {} steps summed", p.step, p.seconds, p.best_score, p.summed),
        "what `clerestory train` wrote");
  p.moment_steps = earlier_moment_steps(file, where), p.kept = kept_moments(file, where);
  p.history = stored_history(file, where);
  if (MeanMaps::stored(file)) p.means = MeanMaps::restore(file, where);
  return p;
}

}  // namespace clerestory
