// How sharp predicted maps are: errors in a band along the true maps' edges, in photographs larger than nets see,
// beside true maps of a small size brought back to that of the photograph.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_edge_keys(Schema& schema);

/// study.kind = "edges". Returns the run directory.
std::string run_edge_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
