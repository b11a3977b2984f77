#include "experiments/evaluation/real_scale.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace fs = std::filesystem;

double RealScale::factor() const {
  std::vector<double> off;
  for (const ScaledFrame& frame : frames) off.push_back(std::exp(std::abs(std::log(frame.scale))));
  return median(off);
}

std::string RealScale::text() const {
  const auto [least, most] = std::ranges::minmax(frames, {}, &ScaledFrame::scale);
  return fmt::format("a factor of {:.2f} on {} real photograph{} ({:.2f} to {:.2f} times the measured scale)", factor(),
                     frames.size(), frames.size() == 1 ? "" : "s", least.scale, most.scale);
}

fs::path frames_file(const fs::path& weights) { return fs::path(weights).replace_extension(".frames.json"); }

std::optional<RealScale> real_scale(const fs::path& weights, const std::string& hash) {
  const fs::path file = frames_file(weights);
  if (!fs::exists(file)) return std::nullopt;
  try {
    const nlohmann::json json = parse_json_object(read_file(file, 1 << 20), file.string());
    if (json.at("facts").at("weights hash") != hash) return std::nullopt;
    RealScale scale;
    for (const auto& frame : json.at("frames")) {
      scale.frames.push_back({frame.at("frame"), frame.at("scale_over_measured"), frame.at("metres_over_measured")});
      if (!(scale.frames.back().scale > 0))
        throw usage_error("not a ratio above 0", file.string(), scale.frames.back().name);
    }
    return scale.frames.empty() ? std::nullopt : std::optional(scale);
  } catch (const nlohmann::json::exception& error) {
    throw usage_error(std::string("not what `clerestory evaluate --frames` writes: ") + error.what(), file.string());
  }
}

}  // namespace clerestory
