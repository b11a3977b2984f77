// What counts as a lamp or window in a photograph: white in one for a screen, far above the room in linear radiance.
#include <gtest/gtest.h>

#include <algorithm>

#include "nets/scene.hpp"

namespace clerestory {
namespace {

/// Walls of 0.2 and a lamp of 10x10 pixels, of so much times a colour, at (20, 10).
Image room(float lamp) {
  Image photo(100, 80, 3, 0.2f);
  const float colour[3] = {1, 0.8f, 0.6f};
  for (int c = 0; c < 3; ++c)
    for (int y = 10; y < 20; ++y)
      for (int x = 20; x < 30; ++x) photo.at(c, y, x) = lamp * colour[c];
  return photo;
}

long count(const Image& flags) { return std::ranges::count(flags.data, 1.0f); }

TEST(LampFlags, OfLinearRadianceAreFarAboveTheRoomInAnyUnit) {
  for (const float unit : {1e-3f, 1.0f, 1e5f}) {
    const Image flags = lamp_flags(scaled(room(50), unit));
    EXPECT_EQ(count(flags), 100) << unit;
    EXPECT_EQ(flags.at(0, 10, 20), 1);
    EXPECT_EQ(flags.at(0, 9, 20), 0);
    EXPECT_EQ(count(lamp_flags(scaled(room(1), unit))), 0) << "a white wall in the sun is no lamp";
  }
}

TEST(LampFlags, ABrightPixelOrABlackPictureHasNone) {
  Image glint(100, 80, 3, 0.2f);
  for (int c = 0; c < 3; ++c) glint.at(c, 40, 40) = 100;
  EXPECT_EQ(count(lamp_flags(glint)), 0);
  EXPECT_EQ(count(lamp_flags(Image(100, 80, 3))), 0);
  Image dark = room(50);
  for (float& v : dark.data) v = v > 1 ? v : 0;  // the 95th percentile is 0
  EXPECT_EQ(count(lamp_flags(dark)), 0);
}

TEST(LampFlags, OfAPhotographAreWhite) {
  Image photo = room(50);
  for (float& v : photo.data) v = std::min(v, 1.0f);
  EXPECT_EQ(count(emission_flags(photo)), 100);
  photo.at(2, 10, 20) = 0.9f;
  EXPECT_EQ(count(emission_flags(photo)), 99);
  EXPECT_EQ(count(emission_flags(room(1))), 0) << "one channel alone is white";
}

}  // namespace
}  // namespace clerestory
