// What a user gets, of rooms whose content no training has seen: maps predicted from one photograph as a camera takes
// it (clipped, 8 bits), the picture rendered again, the light at points in free air, balls put on a surface and what
// they change around them. Beside each the strongest simple answers: a constant light fitted to the photograph as lamps
// are, its mean colour, the photograph itself as light; then all of it again with true maps. Depth takes no scale from
// the truth: a ball rests on the surface that the maps say is there, as large as it looks.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_user_keys(Schema& schema);

/// study.kind = "user". Returns the run directory. Throws usage_error where weights are missing.
std::string run_user_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
