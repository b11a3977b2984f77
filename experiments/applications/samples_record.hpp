// How many samples a picture has and what error they came to, in its record: of a re-render, inserted objects, an edit.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/report/provenance.hpp"
#include "nets/rounds.hpp"

namespace clerestory {

/// "64 a pixel, guided, sobol" into the facts.
void record_samples(const RenderSettings& settings, Provenance& record);

/// What rounds to `goal` reached, into facts ("error of the re-render", `of` being "the re-render") and figures; says
/// it for `command`.
void record_rounds(const RenderGoal& goal, const std::vector<RenderRound>& rounds, const std::string& of,
                   const std::string& command, Provenance& record);

}  // namespace clerestory
