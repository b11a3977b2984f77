// FLIP beside its authors' own evaluator: tests/data/flip is made by experiments/peers/golden_flip.py.
#include "experiments/evaluation/flip.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "host/io/safetensors.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

struct Flip : testing::Test {
  TensorFile file = read_safetensors(std::string(CLERESTORY_TEST_DATA) + "/flip/flip.safetensors");

  Image picture(const std::string& name) const {
    const StoredTensor& stored = file.get(name, "flip");
    Image image(static_cast<int>(stored.shape[2]), static_cast<int>(stored.shape[1]),
                static_cast<int>(stored.shape[0]));
    image.data = stored.floats();
    return image;
  }
};

// The evaluator computes in float.
TEST_F(Flip, IsThatOfItsAuthorsAtEveryPixel) {
  for (const std::string name : {"noisy", "moved", "ends"}) {
    const Image golden = picture(name + ".flip"), map = flip(picture(name + ".reference"), picture(name + ".test"));
    ASSERT_EQ(map.data.size(), golden.data.size());
    EXPECT_GT(mean(std::span<const float>(golden.data)), 0.2);
    for (std::size_t i = 0; i < map.data.size(); ++i)
      ASSERT_NEAR(map.data[i], golden.data[i], 1e-4) << name << " pixel " << i;
  }
}

TEST_F(Flip, IsNothingOfEqualPicturesAndTheSameBothWays) {
  const Image reference = picture("noisy.reference"), test = picture("noisy.test");
  for (const float v : flip(reference, reference).data) ASSERT_EQ(v, 0);
  EXPECT_EQ(flip(reference, test).data, flip(test, reference).data);
  Image brighter = reference;  // what no display shows
  for (float& v : brighter.data)
    if (v == 1) v = 7;
  EXPECT_EQ(flip(reference, brighter).data, flip(reference, reference).data);
}

TEST_F(Flip, SeenFromFartherAwayNoiseIsLess) {
  const Image reference = picture("noisy.reference"), test = picture("noisy.test");
  const auto seen = [&](double pixels_per_degree) {
    return mean(std::span<const float>(flip(reference, test, pixels_per_degree).data));
  };
  EXPECT_LT(seen(2 * kFlipPixelsPerDegree), 0.9 * seen(kFlipPixelsPerDegree));
}

TEST_F(Flip, UnlikePicturesAreRefused) {
  const Image reference = picture("noisy.reference");
  EXPECT_THROW(flip(reference, Image(reference.width, reference.height + 1, 3)), Error);
  EXPECT_THROW(flip(reference, Image(reference.width, reference.height, 1)), Error);
}

}  // namespace
}  // namespace clerestory
