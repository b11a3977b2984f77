// What a trained light is worth: its tables for studies of trainings.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/bench/light_bench.hpp"
#include "experiments/studies/sweep.hpp"
#include "host/cl/device.hpp"

namespace clerestory {

/// What a training cost and what asking its result costs; every table of measures ends with it.
struct LightCosts {
  double steps = 0;                // of training
  double step_seconds = 0;         // of a step; NaN: there was none
  std::optional<RaySeconds> rays;  // nothing of nets that have not two parts
};

struct LightMeasuring {
  std::filesystem::path test;  // folder of views that no training saw, with its list "test"
  int width = 160, height = 120;
  bool clamped = false;               // the nets read pictures clamped to [0, 1]; the truth never is
  int spp = 64;                       // samples a pixel of pictures rendered again
  std::vector<std::string> measures;  // of light_measures(), beside the errors of the light
};

/// "range": log-intensity range; "rerender": pictures rendered again under the light, by roughness.
const std::vector<std::string>& light_measures();

/// Judges a finished training's last weights: tables "light", and those asked for.
RunTables measure_light(const std::filesystem::path& run, const LightMeasuring& options, Device device);

/// Pixels that are compared when a picture is rendered again, by roughness.
struct RoughnessBin {
  std::string name;
  double low, high;
  bool holds(double roughness) const { return roughness >= low && (roughness < high || high == 1); }
};
/// Three that share no pixel, and all.
const std::vector<RoughnessBin>& roughness_bins();

}  // namespace clerestory
