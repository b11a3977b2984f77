#include "experiments/weights/weights.hpp"

#include <array>
#include <cmath>
#include <deque>
#include <set>

#include "experiments/weights/imported.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/metadata.hpp"
#include "experiments/weights/stored_states.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

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

/// Tensors and metadata of weights, but for the mean maps.
TensorFile weights_of(const States& states, const History& history, const WeightsFacts& facts) {
  TensorFile file;
  std::uint64_t numbers = 0;
  for (const auto& [name, shape] : facts.states) {
    file.tensors[name] = stored_state(states, name);
    numbers += static_cast<std::uint64_t>(shape.count());
  }
  std::set<std::uint64_t> seeds;
  for (const Leg& leg : history.legs) seeds.insert(leg.seed);
  file.metadata["kind"] = "weights";
  file.metadata["net"] = facts.net;
  file.metadata["preset"] = facts.preset;
  file.metadata["width"] = std::to_string(facts.size.width);
  file.metadata["height"] = std::to_string(facts.size.height);
  file.metadata["longer_side"] = std::to_string(std::max(facts.size.width, facts.size.height));
  file.metadata["numbers"] = std::to_string(numbers);
  file.metadata["hours"] = facts_text(history.hours());
  file.metadata["views_seen"] = std::to_string(history.views_seen());
  file.metadata["seeds"] = fmt::format("{}", fmt::join(seeds, ","));
  file.metadata["commit"] = facts.commit;
  file.metadata["history"] = history_json(history);
  describe_validation(file, history);
  return file;
}

Size stored_size(const TensorFile& file, const std::string& where) {
  return {whole_fact(file, "width", where, 16, 4096), whole_fact(file, "height", where, 16, 4096)};
}

/// "maps" or "light", or "encoder" where there is no more.
std::string trained_kind(const TensorFile& file, const std::string& where) {
  const auto kind = file.metadata.find("kind");
  const bool said = kind != file.metadata.end() && (kind->second == "light" || kind->second == kImportedKind);
  return said ? kind->second : stored_history(file, where).kind();
}

void must_be_maps(const TensorFile& file, const std::string& where) {
  if (const std::string kind = trained_kind(file, where); kind != "maps")
    throw usage_error(fmt::format("these are weights of {} {}", kind == "light" ? "the" : "an", kind), where, "",
                      "weights of the maps");
}

void must_be_light(const TensorFile& file, const std::string& where) {
  if (const std::string kind = trained_kind(file, where); kind != "light")
    throw usage_error("these are no weights of the light", where, "weights of the " + kind,
                      "what `clerestory weights export` or `train` wrote for model.kind=light");
}

constexpr std::array<const char*, 2> light_parts{"local", "global"};
constexpr const char* kGain = "gain";

/// "encoder.conv1.weight" of that state, or of the light's "local.encoder.conv1.weight"; empty for others.
std::string name_in_encoder(const std::string& state) {
  for (const std::string& scope : {std::string(), light_parts[0] + std::string("."), light_parts[1] + std::string(".")})
    if (state.starts_with(scope + "encoder.")) return state.substr(scope.size());
  return {};
}

/// Of the light out of view; checkpoints and older files say nothing of it.
double stored_gain(const TensorFile& file, const std::string& where) {
  return file.metadata.contains(kGain) ? real_fact(file, kGain, where, 0, kMostGain) : 1;
}

LightSizes stored_sizes(const TensorFile& file, const std::string& where) {
  LightSizes sizes = light_from_text(fact(file, "net", where), where);
  sizes.out_of_view.gain = stored_gain(file, where);
  return sizes;
}

std::filesystem::path light_file(const std::filesystem::path& folder, const std::string& part) {
  return folder / ("light_" + part + ".safetensors");
}

/// Both parts of a folder as one file.
TensorFile read_light_folder(const std::filesystem::path& folder) {
  TensorFile both;
  const std::string twin = light_file(folder, light_parts[0]).string();
  for (const std::string part : light_parts) {
    const std::filesystem::path path = light_file(folder, part);
    const std::string where = path.string();
    TensorFile file = read_finite_safetensors(path);
    must_be_light(file, where);
    if (fact(file, "part", where) != part)
      throw usage_error("this is another part of the light", where, fact(file, "part", where), part);
    const LightSizes sizes = light_from_text(fact(file, "net", where), where);
    for (const auto& [name, shape] : light_states(sizes))
      if (name.starts_with(part + ".")) shaped_tensor(file, name, shape, where);
    if (both.metadata.empty()) both.metadata = file.metadata;
    for (const char* key : {"net", "preset", "width", "height", "history"})
      if (fact(file, key, where) != fact(both, key, twin))
        throw usage_error("the two parts of the light do not belong together", fmt::format("{}: {}", where, key),
                          fact(file, key, where), fmt::format("{} as in {}", fact(both, key, twin), twin));
    if (const double gain = stored_gain(file, where), own = stored_gain(both, twin); gain != own)
      throw usage_error("the two parts of the light do not belong together", fmt::format("{}: {}", where, kGain),
                        fmt::format("{}", gain), fmt::format("{} as in {}", own, twin));
    both.tensors.merge(file.tensors);
  }
  return both;
}

/// Of a checkpoint that has averages of its parameters these: they are what was judged and what is exported.
TensorFile read_judged(const std::filesystem::path& path) {
  TensorFile file = read_finite_safetensors(path);
  const std::string prefix = "average.";  // average_name() of host/ops/nn/moving_average.hpp
  std::map<std::string, StoredTensor> averages;
  for (const auto& [name, tensor] : file.tensors)
    if (name.starts_with(prefix)) averages.emplace(name.substr(prefix.size()), tensor);
  for (auto& [name, tensor] : averages) file.tensors[name] = std::move(tensor);
  return file;
}

TensorFile read_weights_files(const std::filesystem::path& path) {
  return std::filesystem::is_directory(path) ? read_light_folder(path) : read_judged(path);
}

/// What a file of the given kind says about its net, as this program would write it.
std::string net_of(const TensorFile& file, const std::string& where) {
  const std::string& text = fact(file, "net", where);
  return trained_kind(file, where) == "light" ? light_text(light_from_text(text, where)) : text;
}

void fill(LoadedStates& out, const TensorFile& file, const std::string& where,
          const std::map<std::string, Shape>& wanted, Device device) {
  out.metadata = file.metadata;
  out.preset = fact(file, "preset", where);
  out.size = stored_size(file, where);
  out.history = stored_history(file, where);
  out.states = std::make_shared<States>(std::move(device));
  for (const auto& [name, shape] : wanted) set_state(*out.states, name, shape, file, where);
}

}  // namespace

void write_weights(const std::filesystem::path& path, const States& states, const History& history,
                   const std::optional<MeanMaps>& means, const WeightsFacts& facts) {
  TensorFile file = weights_of(states, history, facts);
  if (means) means->store(file);
  store_moments(file, facts.moments);
  write_safetensors(path, file, FloatStorage::F16);
}

void write_light(const std::filesystem::path& folder, const States& states, const History& history,
                 const WeightsFacts& facts) {
  std::deque<AtomicFile> files;  // all are written before one is in its place: a pair of unlike parts is none
  for (const std::string part : light_parts) {
    WeightsFacts own = facts;
    std::erase_if(own.states, [&](const auto& state) { return !state.first.starts_with(part + "."); });
    TensorFile file = weights_of(states, history, own);
    file.metadata["kind"] = "light", file.metadata["part"] = part, file.metadata[kGain] = facts_text(facts.gain);
    store_moments(file, facts.moments, part + ".");
    const std::filesystem::path path = light_file(folder, part);
    write_safetensors(files.emplace_back(path), path.string(), file, FloatStorage::F16);
  }
  for (AtomicFile& file : files) file.commit();
}

std::vector<std::filesystem::path> weights_files(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::filesystem::path> files;
  for (const char* part : light_parts) files.push_back(light_file(path, part));
  return files;
}

InitialWeights read_initial_weights(const std::filesystem::path& path, States& states, const std::string& net,
                                    const std::map<std::string, Shape>& wanted) {
  const std::string where = path.string();
  const TensorFile file = read_weights_files(path);
  if (file.metadata.contains("net") && net_of(file, where) != net)
    throw usage_error("weights of another net", where, file.metadata.at("net"), net);
  for (const auto& [name, shape] : wanted) set_state(states, name, shape, file, where);
  const Moments moments = stored_moments(file, where);
  const bool whole = set_moments(states, moments, where);
  InitialWeights initial{
      stored_history(file, where), whole ? moments.steps : 0, moments_of_others(moments, states), {}};
  if (MeanMaps::stored(file)) initial.means = MeanMaps::restore(file, where);
  return initial;
}

void read_encoder_weights(const std::filesystem::path& path, States& states,
                          const std::map<std::string, Shape>& wanted) {
  const TensorFile file = read_finite_safetensors(path);
  const std::string where = path.string();
  const std::string way_out = "an encoder of the preset's layers and channels, or none";
  std::set<std::string> used;
  for (const auto& [name, shape] : wanted) {
    const std::string own = name_in_encoder(name);
    if (own.empty()) continue;
    const auto stored = file.tensors.find(own);
    if (stored == file.tensors.end() || stored->second.shape != stored_shape(shape))
      throw usage_error("the weights are of another encoder", fmt::format("{}: {}, for {}", where, own, name),
                        stored == file.tensors.end() ? "none" : shape_text(stored->second.shape), way_out);
    states.set(name, Tensor(shape, stored->second.floats(where + ": " + own)));
    used.insert(own);
  }
  if (used.size() != file.tensors.size())
    throw usage_error("the encoder has no use for all of its weights", where,
                      fmt::format("{} tensors of which it takes {}", file.tensors.size(), used.size()), way_out);
}

History read_history(const std::filesystem::path& path) {
  return stored_history(read_finite_safetensors(path), path.string());
}

Moments read_moments(const std::filesystem::path& path) {
  return stored_moments(read_weights_files(path), path.string());
}

MgnetSize read_maps_size(const std::filesystem::path& path) {
  const std::string where = path.string();
  const TensorFile file = read_safetensors(path);
  must_be_maps(file, where);
  return net_from_text(fact(file, "net", where), where);
}

LightSizes read_light_sizes(const std::filesystem::path& path) {
  const std::filesystem::path first = weights_files(path)[0];
  const TensorFile file = read_safetensors(first);
  must_be_light(file, first.string());
  return stored_sizes(file, first.string());
}

LoadedWeights load_weights(const std::filesystem::path& path, Device device) {
  const std::string where = path.string();
  const TensorFile file = read_judged(path);
  must_be_maps(file, where);
  LoadedWeights out;
  out.net = net_from_text(fact(file, "net", where), where);
  fill(out, file, where, maps_states(out.net), std::move(device));
  if (MeanMaps::stored(file)) out.means = MeanMaps::restore(file, where);
  return out;
}

LoadedLight load_light(const std::filesystem::path& path, Device device) {
  const std::string where = path.string();
  const TensorFile file = read_weights_files(path);
  must_be_light(file, where);
  LoadedLight out;
  out.net = stored_sizes(file, where);
  fill(out, file, where, light_states(out.net), std::move(device));
  return out;
}

}  // namespace clerestory
