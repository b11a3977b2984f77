// The oracle ladder: which link of the learned light limits. In generated rooms that no training saw, hits, in-view
// radiance, out-of-view radiance and maps are replaced by the truth (linked_light.hpp), each alone and one after
// another, from all predicted to all true, for two jobs: the re-render of the view, and balls put into it, beside the
// tracer's pictures.
//
// Compared: pixels that are shaded under the true maps and do not emit; what pixels emit is in no picture. A pixel that
// predicted maps leave black counts as such. Balls: the pixels that show the ball; where predicted depth hides it the
// photograph shows. Predicted depth is brought to scale at the ball's foot. The tracer's own light for a ball is that
// of the room without it; one more row asks it of the room with the ball, which leaves only noise. True light is
// noisier than learned light. So relMSE is that of the picture without its noise: a mean of products of two
// differences, each of another seed of the layer and another half of the reference's samples (relmse_of_pair()). PSNR
// is of single pictures, noise and all.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_ladder_keys(Schema& schema);

/// study.kind = "ladder". Returns the run directory. Throws usage_error where weights of the light or of the maps are
/// missing.
std::string run_ladder_study(const Config& config, const std::vector<std::string>& command);

/// Means of `after` / means of `before` - 1, errors of each room, over rooms where both are finite; nothing where the
/// interval of their difference room by room holds 0 (intervals.hpp) or fewer than two rooms have both.
std::optional<double> clear_change(const std::vector<double>& before, const std::vector<double>& after);

}  // namespace clerestory
