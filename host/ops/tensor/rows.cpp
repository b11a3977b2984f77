#include "host/ops/tensor/rows.hpp"

#include <algorithm>
#include <cstdlib>

namespace clerestory {
namespace {

constexpr int kGpuGroup = 128;
constexpr int kCpuLanes = 16;
constexpr int kCpuBlock = 8192, kGpuBlock = 1024;  // elements of one work-group

}  // namespace

int row_group(const Device& device) {
  if (const char* text = std::getenv("CLERESTORY_GROUP")) {
    const int group = std::atoi(text);
    if (group < 1 || (group & (group - 1)) != 0)
      throw usage_error("not a power of two", "CLERESTORY_GROUP", text, "1, 2, 4, ...");
    return group;
  }
  if (device.info().cpu) return 1;
  int group = kGpuGroup;
  while (group > static_cast<int>(device.info().max_group)) group /= 2;
  return group;
}

Defines row_defines(const Device& device, Defines more) {
  more["GROUP"] = std::to_string(row_group(device));
  return more;
}

Range row_range(const Device& device, long x, long y, long z) {
  const int group = row_group(device);
  return {{size(x * group), size(y), size(z)}, {size(group), 1, 1}, true};
}

Range lane_range(const Device& device, long count, int vectors) {
  const int group = row_group(device), each = vectors * (group == 1 ? kCpuLanes : 1);
  return Range::of(size((count + each - 1) / each), size(group));
}

Blocks row_blocks(const Device& device, long count) {
  const long length = std::min<long>(count, row_group(device) == 1 ? kCpuBlock : kGpuBlock);
  return {static_cast<int>(length), static_cast<int>((count + length - 1) / length)};
}

}  // namespace clerestory
