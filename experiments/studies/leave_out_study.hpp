// What a re-render leaves out for what a scene lacks: seconds with and without, by scene and by what is left out, and
// the error that this makes. Scenes of unlike needs are made of rooms with known maps: as they are and as nets predict
// them, without metals, of mirrors, matt, of one material, an empty box, and under other lights.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_leave_out_keys(Schema& schema);

/// study.kind = "leave_out". Returns the run directory.
std::string run_leave_out_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
