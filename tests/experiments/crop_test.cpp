// The part of a camera's picture that holds some pixels: the same rays, put back where they came from.
#include "experiments/truth/crop.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/roundings.hpp"

namespace clerestory {
namespace {

TEST(Crop, HoldsItsPixelsAndSeesWhatTheyDid) {
  const Camera camera = Camera::from_fov(12, 9, 70);
  std::vector<bool> pixels(12 * 9, false);
  pixels[3 * 12 + 4] = pixels[6 * 12 + 9] = true;
  const Crop crop = crop_to(camera, pixels);
  EXPECT_EQ(crop.x, 4);
  EXPECT_EQ(crop.y, 3);
  ASSERT_EQ(crop.camera.width, 6);
  ASSERT_EQ(crop.camera.height, 4);
  for (const auto& [x, y] : {std::pair{0.5, 0.5}, {5.5, 3.5}, {2.0, 1.0}})  // a difference of places up to 12
    EXPECT_NEAR(glm::length(crop.camera.ray(x, y) - camera.ray(4 + x, 3 + y)), 0, 8 * 12 * kDoubleRounding);

  Image whole(12, 9, 3, 0.5f);
  paste(Image(6, 4, 3, 2.0f), crop, pixels, whole);
  EXPECT_EQ(whole.at(1, 3, 4), 2);
  EXPECT_EQ(whole.at(2, 6, 9), 2);
  EXPECT_EQ(std::ranges::count(whole.data, 2.0f), 2 * 3) << "pixels that are not asked for stay";
}

}  // namespace
}  // namespace clerestory
