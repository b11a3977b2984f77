#include "experiments/training/checkpoint.hpp"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <set>

#include "experiments/training/network.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr const char* progress_tensor = "training.progress";

std::vector<long> stored_shape(const Shape& s) { return {s.n, s.c, s.h, s.w}; }

std::string shape_text(const std::vector<long>& shape) { return fmt::format("{}", fmt::join(shape, "x")); }

StoredTensor stored_state(const States& states, const std::string& name) {
  const Tensor tensor = states.get(name);
  for (const double v : tensor.real)
    if (!std::isfinite(v))
      throw Error(ErrorKind::Failed, "a state of the network is not finite; the checkpoint before stays", name,
                  fmt::format("{}", v));
  return StoredTensor(stored_shape(tensor.shape), tensor.floats());
}

void set_state(States& states, const std::string& name, const StoredTensor& stored, const std::string& where) {
  const Shape shape = states.view(name).shape;
  if (stored.shape != stored_shape(shape))
    throw usage_error("a tensor has another shape than the network", where + ": " + name, shape_text(stored.shape),
                      shape_text(stored_shape(shape)));
  states.set(name, Tensor(shape, stored.floats(where + ": " + name)));
}

const std::string& fact(const TensorFile& file, const std::string& key, const std::string& where) {
  const auto found = file.metadata.find(key);
  if (found == file.metadata.end())
    throw usage_error("the metadata lack a key", where, "no " + key, "a file written by `clerestory train`");
  return found->second;
}

int whole_fact(const TensorFile& file, const std::string& key, const std::string& where, int least, int most) {
  const std::string& text = fact(file, key, where);
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != 0 || value < least || value > most)
    throw usage_error("a value of the metadata makes no sense", where + ": " + key, text,
                      fmt::format("{} to {}", least, most));
  return static_cast<int>(value);
}

void must_agree(const TensorFile& file, const std::string& key, const std::string& expected, const std::string& where) {
  if (fact(file, key, where) != expected)
    throw usage_error("the checkpoint belongs to another run", where + ": " + key, fact(file, key, where), expected);
}

std::string facts_text(double value) { return fmt::format("{}", value); }

void describe_validation(TensorFile& file, const History& history) {
  if (history.legs.empty() || history.legs.back().curve.empty()) return;
  const HistoryPoint& last = history.legs.back().curve.back();
  file.metadata["score"] = facts_text(last.score);
  file.metadata["scale_error"] = facts_text(last.scale_error);
  const std::vector<ErrorName>& names = error_names(history.kind());
  for (std::size_t i = 0; i < names.size(); ++i)
    if (std::isfinite(last.errors[i])) file.metadata["error." + names[i].key] = facts_text(last.errors[i]);
}

History stored_history(const TensorFile& file, const std::string& where) {
  const auto found = file.metadata.find("history");
  return found == file.metadata.end() ? History{} : history_from_json(found->second, where);
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
  file.metadata["kind"] = "checkpoint";
  file.metadata["preset"] = identity.preset;
  file.metadata["width"] = std::to_string(identity.size.width),
  file.metadata["height"] = std::to_string(identity.size.height);
  file.metadata["net"] = identity.net;
  file.metadata["seed"] = std::to_string(identity.seed);
  file.metadata["config_hash"] = identity.config_hash;
  file.metadata["views_hash"] = fmt::format("{:016x}", identity.views_hash);
  file.metadata["step"] = std::to_string(p.step);
  file.metadata["history"] = history_json(p.history);
  write_safetensors(path, file);
}

TrainingProgress read_checkpoint(const std::filesystem::path& path, States& states, const RunIdentity& identity) {
  const std::string where = path.string();
  const TensorFile file = read_safetensors(path);
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
    if (!is_frozen_feature(name)) set_state(states, name, file.get(name, where), where);

  const auto& words = file.get(progress_tensor, where).words(where);
  if (words.size() < 4) throw usage_error("the checkpoint's progress is cut short", where);
  TrainingProgress p;
  p.step = static_cast<std::int64_t>(words[0]);
  p.seconds = std::bit_cast<double>(words[1]), p.best_score = std::bit_cast<double>(words[2]);
  p.summed = static_cast<std::int64_t>(words[3]);
  for (std::size_t i = 4; i < words.size(); ++i) p.loss_sums.push_back(std::bit_cast<double>(words[i]));
  p.history = stored_history(file, where);
  if (MeanMaps::stored(file)) p.means = MeanMaps::restore(file, where);
  return p;
}

void write_weights(const std::filesystem::path& path, const States& states, const History& history,
                   const std::optional<MeanMaps>& means, const WeightsFacts& facts) {
  TensorFile file;
  std::uint64_t numbers = 0;
  for (const auto& [name, shape] : facts.states) {
    file.tensors[name] = stored_state(states, name);
    numbers += static_cast<std::uint64_t>(shape.count());
  }
  if (means) means->store(file);
  std::set<std::uint64_t> seeds;
  for (const Leg& leg : history.legs) seeds.insert(leg.seed);
  file.metadata["kind"] = "weights";
  file.metadata["net"] = facts.net;
  file.metadata["preset"] = facts.preset;
  file.metadata["width"] = std::to_string(facts.size.width),
  file.metadata["height"] = std::to_string(facts.size.height);
  file.metadata["longer_side"] = std::to_string(std::max(facts.size.width, facts.size.height));
  file.metadata["numbers"] = std::to_string(numbers);
  file.metadata["hours"] = facts_text(history.hours());
  file.metadata["views_seen"] = std::to_string(history.views_seen());
  file.metadata["seeds"] = fmt::format("{}", fmt::join(seeds, ","));
  file.metadata["commit"] = facts.commit;
  file.metadata["history"] = history_json(history);
  describe_validation(file, history);
  write_safetensors(path, file, FloatStorage::F16);
}

History read_initial_weights(const std::filesystem::path& path, States& states, const std::string& net,
                             const std::map<std::string, Shape>& wanted) {
  const std::string where = path.string();
  const TensorFile file = read_safetensors(path);
  if (const auto found = file.metadata.find("net"); found != file.metadata.end() && found->second != net)
    throw usage_error("weights of another net", where, found->second, net);
  for (const auto& [name, shape] : wanted) set_state(states, name, file.get(name, where), where);
  return stored_history(file, where);
}

LoadedWeights load_weights(const std::filesystem::path& path, Device device) {
  const std::string where = path.string();
  const TensorFile file = read_safetensors(path);
  LoadedWeights out;
  out.metadata = file.metadata;
  out.preset = fact(file, "preset", where);
  out.net = net_from_text(fact(file, "net", where), where);
  out.size = {whole_fact(file, "width", where, 16, 4096), whole_fact(file, "height", where, 16, 4096)};
  out.history = stored_history(file, where);
  if (MeanMaps::stored(file)) out.means = MeanMaps::restore(file, where);
  out.states = std::make_shared<States>(std::move(device));
  for (const auto& [name, shape] : inference_states(out.net)) {
    const StoredTensor& stored = file.get(name, where);
    if (stored.shape != stored_shape(shape))
      throw usage_error("a tensor has another shape than the network", where + ": " + name, shape_text(stored.shape),
                        shape_text(stored_shape(shape)));
    out.states->set(name, Tensor(shape, stored.floats(where + ": " + name)));
  }
  return out;
}

}  // namespace clerestory
