#include "experiments/evaluation/rivals.hpp"

#include "experiments/evaluation/retinex.hpp"
#include "experiments/evaluation/room_box.hpp"

namespace clerestory {

const std::array<RivalInfo, rival_count>& rivals() {
  static const std::array<RivalInfo, rival_count> all{
      {{"retinex", "Retinex",
        "Retinex: albedo by colour Retinex (Grosse et al. 2009) with the picture's chromaticity; thresholds chosen on "
        "experiments/rooms/validation.txt"},
       {"box", "box of lines",
        "box of lines: normals and depth of an empty box fitted to the picture's edges by the known camera (Coughlan & "
        "Yuille 1999 for its directions), without furniture"}}};
  return all;
}

std::vector<std::string> rival_conventions() {
  std::vector<std::string> lines;
  for (const RivalInfo& rival : rivals()) lines.emplace_back(rival.convention);
  lines.emplace_back(
      "simple rivals read no truth and learn nothing; ratio and strict ratio are to trivial predictors alone, the "
      "ratio "
      "to the best rival has a column of its own");
  return lines;
}

RivalErrors rival_errors(const PreparedView& view) {
  RivalErrors all;
  const auto at = [](MapError error) { return static_cast<std::size_t>(error); };
  all[0][at(MapError::Albedo)] = scale_invariant_mse(retinex_albedo(view.image), view.truth.albedo, view.masks.albedo);
  if (!view.camera) return all;
  const BoxMaps box = maps_of(fitted_box(view.image, *view.camera), *view.camera);
  all[1][at(MapError::Normal)] = mean_angle(box.normal, view.truth.normal, view.masks.geometry);
  all[1][at(MapError::Depth)] = rooted_si_log(box.depth, view.truth.depth, view.masks.geometry);
  return all;
}

}  // namespace clerestory
