// Mirror objects in rooms whose content no training has seen, as Zhu et al. 2022, figures 6 and 7, show them: the
// tracer's beside what learned light makes of them, a rival's light where one is named, and the
// simplest answers, from one photograph each; with objects.baseline from each of two cameras. PSNR alone would let blur
// win: beside it stands how much structure the reflections have, gradient energy of log radiance over the truth's.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_objects_keys(Schema& schema);

/// study.kind = "objects". Returns the run directory. Throws usage_error where weights are missing, and on an unknown
/// light or shape.
std::string run_objects_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
