// A data set of few, small views.
#pragma once

namespace clerestory {

inline constexpr const char* kSmallManifest = R"(# Small.

name = "small"
version = 3

[views]
count = 2
width = 32
height = 24
spp = 4
clamp = 1.0
roll = 5.0
close_ups = 0.25

[light]
wanted = true
spp = 1
probes = 1

[train]
rooms = 3
seed = 7
setting = "training"

[test]
rooms = 1
seed = 7
setting = "held_out"
)";

}  // namespace clerestory
