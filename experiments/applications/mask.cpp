#include "experiments/applications/mask.hpp"

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {

Image read_mask(const std::filesystem::path& path, int width, int height) {
  const auto [image, alpha] = read_image_and_alpha(path);
  if (alpha)
    throw usage_error("is the mask in its colours or in its alpha?", path.string(), "both", "a picture without alpha");
  if (image.width != width || image.height != height)
    throw usage_error("the mask has another size than the picture", path.string(),
                      fmt::format("{}x{}", image.width, image.height), fmt::format("{}x{}", width, height));
  Image mask(width, height, 1);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    if (image.data[i] > 0.5f) mask.data[i % mask.pixels()] = 1;
  if (sum(mask.data) == 0) throw usage_error("the mask is empty", path.string(), "no pixel above one half");
  return mask;
}

}  // namespace clerestory
