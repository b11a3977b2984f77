// Values that are numbers.
#pragma once
#include <filesystem>

#include "host/io/image.hpp"

namespace clerestory {

/// Throws usage_error naming `where` and the first pixel, in reading order, that holds NaN or Inf.
void check_finite(const Image& image, const std::filesystem::path& where);

}  // namespace clerestory
