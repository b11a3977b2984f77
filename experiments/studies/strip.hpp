// Pictures side by side, for reports of studies.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/io/image.hpp"

namespace clerestory {

/// One of a row of pictures, and what it shows.
struct StripPicture {
  std::string label;
  Image picture;
};

/// A PNG of radiance pictures of one size in a row, all at the exposure of the first, and their labels beside it.
void write_strip(const std::filesystem::path& png, const std::vector<StripPicture>& pictures);

/// The same of several rows of pictures of one size, display values in [0, 1], one channel as grey; labels row by row.
void write_sheet(const std::filesystem::path& png, const std::vector<std::vector<StripPicture>>& rows);

/// The labels of a strip; none where there are none beside the picture.
std::vector<std::string> strip_labels(const std::filesystem::path& png);

}  // namespace clerestory
