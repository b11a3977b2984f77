// What simple methods that learn nothing and read no truth get on a view, beside the trivial predictors.
#pragma once
#include <array>

#include "experiments/evaluation/prepare.hpp"

namespace clerestory {

struct RivalInfo {
  const char *key, *name;
  const char* convention;  // how it answers, for the table's foot
};
inline constexpr int rival_count = 2;
/// Retinex (albedo), the box of lines (normals, depth).
const std::array<RivalInfo, rival_count>& rivals();

/// Errors of each, of the maps that it answers. The box needs the view's camera: without one it answers nothing.
using RivalErrors = std::array<MapErrors, rival_count>;
RivalErrors rival_errors(const PreparedView& view);
/// What a table with them says at its foot, a line each.
std::vector<std::string> rival_conventions();

}  // namespace clerestory
