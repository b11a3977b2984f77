// The sets of CLBlast's parameters that were measured on a device, kept after each so that nothing is measured twice.
#pragma once
#include <array>

#include "experiments/bench/clblast_search.hpp"
#include "host/cl/device.hpp"

namespace clerestory {

/// What the three searches say of one set each; empty: not of that kernel's.
using ClblastSets = std::map<std::string, ClblastValues>;

class TuneTrials {
 public:
  /// Those in the cache of the device, driver and CLBlast's release; none where there are none, or `again`. A set on
  /// which the process has ended twice is one that is refused.
  TuneTrials(Device device, bool again);

  ClblastSearch& search(const std::string& kernel);
  int sets() const;
  /// Before a measurement, and with what came of it.
  void begin(const ClblastSets& sets);
  void end();

  /// The best sets so far as CLBlast's parameters, with `tried` in their place: {"Xgemm": ..., "Copies": ...}.
  ClblastParameters parameters(const ClblastSets& tried = {}) const;

 private:
  void save() const;
  std::string key_;
  ClblastParameters own_;
  std::array<ClblastSearch, 3> searches_;
  ClblastSets running_;
  int times_ = 0;  // that the running sets were begun
};

}  // namespace clerestory
