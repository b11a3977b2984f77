// What an earlier try of a training recorded of itself: what the one that goes on must share with it, and what it says
// where it does not.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/cl/device.hpp"
#include "host/report/provenance.hpp"
#include "host/report/run_directory.hpp"

namespace clerestory {

/// Names of facts in a training's provenance.
constexpr const char* kMapsFact = "hash of the maps' weights";
constexpr const char* kGemmFact = "matrix products";

class EarlierTry {
 public:
  /// Nothing is known of a run that is new. A record that cannot be read is one that there is none of, which is logged.
  explicit EarlierTry(const RunDirectory& run);

  /// The tile that the run had on this device, so that it goes on with the same; "auto" where there was none.
  std::string tile(const Device& device) const;
  /// Throws usage_error where a light would go on under maps of other weights than it began with.
  void check_maps(const Provenance& now, const std::filesystem::path& maps) const;
  /// Throws usage_error where files that the run read of weights have become others.
  void check_weights(const std::vector<std::filesystem::path>& files) const;
  /// Gives `now` what it read that this try does not, and when it began.
  void hand_on(Provenance& now) const;
  /// What steps after `step` have that those before had not: another device, kernels, products. Kept in `now`, beside
  /// what was said so of steps before; empty where nothing changed.
  std::string note_changes(Provenance& now, std::int64_t step) const;

 private:
  std::optional<std::string> fact(const std::string& name) const;

  std::filesystem::path run_;
  std::optional<Provenance> record_;
};

}  // namespace clerestory
