#include "experiments/studies/strip.hpp"

#include <algorithm>

#include "host/math/statistics.hpp"
#include "host/report/preview.hpp"

namespace clerestory {

void write_strip(const std::filesystem::path& path, const std::vector<Image>& pictures) {
  const Image& first = pictures.at(0);
  const int w = first.width, h = first.height;
  const double exposure = exposure_of(first.data);
  Image strip(static_cast<int>(pictures.size()) * w, h, 3);
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const Image shown = show_radiance(pictures[k], exposure);
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < h; ++y) {
        const float* row = shown.plane(c) + static_cast<std::ptrdiff_t>(y) * w;
        std::copy(row, row + w,
                  strip.plane(c) + static_cast<std::ptrdiff_t>(y) * strip.width + static_cast<int>(k) * w);
      }
  }
  write_png(path, strip, Encoding::Linear);
}

}  // namespace clerestory
