// `clerestory replay`: one sample of a run's re-render taken again, in double beside float.
#pragma once
#include <filesystem>
#include <string>

#include "nets/replay.hpp"

namespace clerestory {

struct ReplayOptions {
  std::filesystem::path run;
  int x = 0, y = 0, sample = 0;  // sample: of all that the run took, the first is 0
  std::string device;
};

struct Replayed {
  std::uint32_t seed = 0;  // of the round that took it
  int spp = 0, of_round = 0;
  std::vector<Quantity> in_double, in_float;
};

/// Throws usage_error: a folder that is no run or does not say how it was rendered, no such pixel or sample, a device
/// without doubles.
Replayed replay_of_run(const ReplayOptions& options);

/// A line for each quantity: in double, in float, and how far they are apart over the size of the former.
std::string replay_text(const Replayed& replayed);
std::string replay_json(const Replayed& replayed);

}  // namespace clerestory
