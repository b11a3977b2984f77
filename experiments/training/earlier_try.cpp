#include "experiments/training/earlier_try.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "host/cl/tile.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr const char* kChangedFact = "changed after step ";

std::optional<Provenance> read_record(const RunDirectory& run) {
  if (!std::filesystem::exists(run / kProvenanceName)) return std::nullopt;
  try {
    return read_provenance(run / kProvenanceName);
  } catch (const Error& e) {
    if (e.kind() != ErrorKind::Usage) throw;
    run.log(fmt::format("{}; it is written anew", e.what()));
    return std::nullopt;
  }
}

}  // namespace

EarlierTry::EarlierTry(const RunDirectory& run) : run_(run.path()), record_(read_record(run)) {}

std::optional<std::string> EarlierTry::fact(const std::string& name) const {
  if (!record_) return std::nullopt;
  const auto found = record_->facts.find(name);
  return found == record_->facts.end() ? std::nullopt : std::optional(found->second);
}

std::string EarlierTry::tile(const Device& device) const {
  const std::optional<std::string> tile = fact("tile");
  if (!tile || record_->device != device.fingerprint()) return "auto";  // all tiles give the same bits
  return std::ranges::find(tiles(), *tile, &Tile::name) != tiles().end() ? *tile : "auto";
}

void EarlierTry::check_maps(const Provenance& now, const std::filesystem::path& maps) const {
  const auto hash = now.facts.find(kMapsFact);
  const std::optional<std::string> then = fact(kMapsFact);
  if (hash != now.facts.end() && then && *then != hash->second)
    throw usage_error("this run has learned under other maps", maps.string(), "hash " + hash->second,
                      "the weights with hash " + *then + ", or a new run");
}

void EarlierTry::check_weights(const std::vector<std::filesystem::path>& files) const {
  if (!record_) return;
  for (const std::filesystem::path& file : files) {
    const auto then = std::ranges::find(record_->inputs, file.string(), &FileRecord::path);
    if (then == record_->inputs.end() || !std::filesystem::exists(file)) continue;
    if (const std::string now = record_file(file).hash; now != then->hash)
      throw usage_error(fmt::format("{} began with other weights", run_.string()), file.string(), "hash " + now,
                        "the weights with hash " + then->hash + ", or a new leg: another run.variant");
  }
}

void EarlierTry::hand_on(Provenance& now) const {
  if (!record_) return;
  now.started = record_->started;
  for (const auto& hash : record_->hashes) now.hashes.insert(hash);
  for (const FileRecord& input : record_->inputs)
    if (std::ranges::find(now.inputs, input.path, &FileRecord::path) == now.inputs.end()) now.inputs.push_back(input);
}

std::string EarlierTry::note_changes(Provenance& now, std::int64_t step) const {
  if (!record_) return {};
  for (const auto& [name, text] : record_->facts)  // of steps that are kept
    if (name.starts_with(kChangedFact) && std::atoll(name.c_str() + std::strlen(kChangedFact)) < step)
      now.facts[name] = text;
  std::vector<std::string> changes;
  const auto compare = [&](const char* what, const std::string& then, const std::string& is) {
    if (!then.empty() && then != is) changes.push_back(fmt::format("{} {} in place of {}", what, is, then));
  };
  const auto kernels = record_->hashes.find("kernels");
  compare("device", record_->device, now.device);
  compare("kernels", kernels == record_->hashes.end() ? "" : kernels->second, now.hashes["kernels"]);
  compare("matrix products", fact(kGemmFact).value_or(""), now.facts[kGemmFact]);
  if (changes.empty()) return {};
  return now.facts[fmt::format("{}{}", kChangedFact, step)] = fmt::format("{}", fmt::join(changes, "; "));
}

}  // namespace clerestory
