// How far predicted metres are off on real photographs: measured by `clerestory evaluate --frames`, kept beside the
// weights.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace clerestory {

/// One photograph with measured depth.
struct ScaledFrame {
  std::string name;
  double scale = 0;   // predicted / measured 99th percentile of depth: what the scale of a run is stated by
  double metres = 0;  // median over pixels of predicted / measured metres: errors of shape as well
};

struct RealScale {
  std::vector<ScaledFrame> frames;  // at least one

  double factor() const;  // the frames' median of how many times the scale is too large or too small
  /// "a factor of 1.59 on 4 real photographs (0.47 to 2.49 times the measured scale)".
  std::string text() const;
};

/// `maps.frames.json` for `maps.safetensors`: what `evaluate --weights W --frames ... --json=W.frames.json` wrote.
std::filesystem::path frames_file(const std::filesystem::path& weights);

/// What was measured with exactly these weights (`hash`: file_hash of the file); nothing where the file is missing or
/// of other weights. Throws usage_error when it cannot be read.
std::optional<RealScale> real_scale(const std::filesystem::path& weights, const std::string& hash);

}  // namespace clerestory
