// Pictures that say which pixels something is about.
#pragma once
#include <filesystem>

#include "host/io/image.hpp"

namespace clerestory {

/// 1 channel: 1 where a channel of the picture is above one half, else 0. Throws usage_error naming the file:
/// unreadable, of another size, no such pixel.
Image read_mask(const std::filesystem::path& path, int width, int height);

}  // namespace clerestory
