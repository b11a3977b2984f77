// A traced room for tests of what takes a view apart.
#pragma once
#include <cstdint>
#include <filesystem>

#include "host/cl/device.hpp"

namespace clerestory {

/// Makes one box room with one view of 64 x 48 and no files of light below `folder`: the view's prefix, ".../000".
std::filesystem::path make_bare_room(const Device& device, const std::filesystem::path& folder, int spp,
                                     std::uint64_t seed = 0);

}  // namespace clerestory
