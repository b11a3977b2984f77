// How kernels written over lib/lanes.clh are launched: one work-group per row, of one work-item on CPUs (16 lanes of a
// vector) and of kGpuGroup on GPUs.
#pragma once
#include "host/graph/op.hpp"

namespace clerestory {

/// Work-items that share a row on this device: a power of two. The environment variable CLERESTORY_GROUP overrides it,
/// so that a test on a CPU can run the bodies that GPUs use.
int row_group(const Device& device);

/// The defines of such a program: GROUP, and those given.
Defines row_defines(const Device& device, Defines more = {});

/// One group per row of a grid of rows.
Range row_range(const Device& device, long x, long y = 1, long z = 1);

/// Work-items that take so many vectors of `lanes` each, for all of `count` numbers.
Range lane_range(const Device& device, long count, int vectors = 1);

/// Rows into which a run of `count` elements is cut: long enough for a work-group to be worth starting.
struct Blocks {
  int length = 0, count = 0;
};
Blocks row_blocks(const Device& device, long count);

inline std::size_t size(long n) { return static_cast<std::size_t>(n); }

}  // namespace clerestory
