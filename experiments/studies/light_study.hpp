// Who answers for incident light, in generated rooms that no net has seen: the raw photograph (`light = image`), SSRT
// alone, the out-of-view part alone, both parts mixed (`light = net`), and the best constant that a view allows.
// Rays leave surfaces and free probes. Errors on hits and misses of SSRT, over all rays, by the distance of a ray's
// origin from the nearest surface; whole panoramas at the probes, beside the mean panorama of the other rooms; and the
// share of the gap from the raw photograph to the truth that the nets close.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// study.kind = "light". Returns the run directory. Throws usage_error when there are no weights of the light.
std::string run_light_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
