// How far the shipped weights are off in metres, as measured on photographs.
#include "experiments/evaluation/real_scale.hpp"

#include <gtest/gtest.h>

#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

TEST(RealScaleOfDepth, IsMeasuredForTheShippedWeights) {
  const fs::path weights = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";
  const std::optional<RealScale> scale = real_scale(weights, file_hash(weights));
  ASSERT_TRUE(scale) << frames_file(weights) << " is of other weights: evaluate --frames";
  EXPECT_GE(scale->frames.size(), 4u);
  EXPECT_FALSE(real_scale(weights, "of other weights"));
  const RealScale three{{{"a", 0.5, 1}, {"b", 1.25, 1}, {"c", 4, 1}}};
  EXPECT_DOUBLE_EQ(three.factor(), 2);
  EXPECT_EQ(three.text(), "a factor of 2.00 on 3 real photographs (0.50 to 4.00 times the measured scale)");
}

}  // namespace
}  // namespace clerestory
