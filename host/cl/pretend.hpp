// Devices that have less than those of this machine, to try what a program does there. Private to host/cl.
#pragma once
#include "host/cl/platforms.hpp"

namespace clerestory {

/// Takes from a device what the environment variable CLERESTORY_PRETEND names, parted by commas: no_fp64,
/// no_unified_memory, max_group=ITEMS, max_allocation=MIB, memory=MIB, local_memory=KIB, and lost_after=LAUNCHES, from
/// which on every call fails as on a device that is gone. Throws ErrorKind::Usage for other words, and for numbers that
/// are none.
void pretend(FoundDevice& device);

}  // namespace clerestory
