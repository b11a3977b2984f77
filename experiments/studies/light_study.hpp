// Who answers for incident light, in generated rooms that no net has seen: both parts of the learned light mixed
// (`light = net`), its out-of-view part alone, the photograph as it is and as cameras clip it (`light = image`), SSRT
// alone, constants (the photograph's mean colour, and one fitted to it), and an oracle, the best constant of the view.
// Rays leave surfaces and free probes. Errors on hits and misses of SSRT, over all rays, by the distance of a ray's
// origin from the nearest surface; whole panoramas at the probes, beside the mean panorama of the other rooms; and the
// share of the way from the better of clipped photograph and mean colour to the truth that the nets go.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// study.kind = "light". Returns the run directory. Throws usage_error when there are no weights of the light.
std::string run_light_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
