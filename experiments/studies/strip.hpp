// Pictures side by side, for reports of studies.
#pragma once
#include <filesystem>
#include <vector>

#include "host/io/image.hpp"

namespace clerestory {

/// A PNG of radiance pictures of one size in a row, all at the exposure of the first.
void write_strip(const std::filesystem::path& path, const std::vector<Image>& pictures);

}  // namespace clerestory
