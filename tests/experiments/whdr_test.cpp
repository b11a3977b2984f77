// WHDR beside values by a script after its published definition, and by hand.
#include "experiments/evaluation/whdr.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/io/files.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

const std::string kData = std::string(CLERESTORY_TEST_DATA) + "/iiw/";

TEST(Whdr, IsWhatTheExampleExpects) {
  const nlohmann::json expected = read_json_object(kData + "expected.json");
  const Judgements judgements = read_judgements(kData + "judgements.json");
  const Image picture = read_photo(std::string(CLERESTORY_SOURCE_DIR) + "/assets/real/office/rgb.png").image;
  const double rounding = 5e-7;  // expected values have six digits
  const auto linear = whdr(picture, judgements), constant = whdr(Image(5, 4, 3, 0.25f), judgements);
  ASSERT_TRUE(linear && constant);
  EXPECT_NEAR(linear->rate, expected["whdr_linear_image_as_reflectance"].get<double>(), rounding);
  EXPECT_NEAR(constant->rate, expected["whdr_constant_reflectance"].get<double>(), rounding);
  EXPECT_EQ(linear->counted, expected["comparisons_counted"].get<int>());
  EXPECT_EQ(linear->passed_over, 2);
  EXPECT_NEAR(linear->weight, expected["weight_sum"].get<double>(), 1e-12);
}

/// Two pixels side by side, their points and one comparison.
std::optional<Whdr> of_two(float left, float right, Darker darker, double weight = 1) {
  Image image(2, 1, 1);
  image.data = {left, right};
  Judgements j;
  j.points = {{1, 0.25, 0.5, true}, {2, 0.75, 0.5, true}};
  j.comparisons = {{0, 1, darker, weight}};
  return whdr(image, j);
}

TEST(Whdr, ADifferenceOfATenthIsTheLimit) {
  EXPECT_EQ(of_two(1, 1.09f, Darker::Equal)->rate, 0);
  EXPECT_EQ(of_two(1, 1.11f, Darker::Equal)->rate, 1);
  EXPECT_EQ(of_two(1, 1.11f, Darker::First)->rate, 0);
  EXPECT_EQ(of_two(1.11f, 1, Darker::Second)->rate, 0);
  EXPECT_EQ(of_two(1.11f, 1, Darker::First)->rate, 1);
  EXPECT_EQ(of_two(0, 1e-11f, Darker::Equal)->rate, 0) << "both are the least";
}

TEST(Whdr, WhatSaysNothingIsPassedOver) {
  EXPECT_FALSE(of_two(1, 1, Darker::Equal, 0));
  Judgements j;
  j.points = {{1, 0, 0, true}, {2, 1, 1, true}, {3, 0, 0, false}};
  j.comparisons = {
      {0, 1, std::nullopt, 1}, {0, 2, Darker::Equal, 1}, {0, 1, Darker::First, 3}, {0, 1, Darker::Equal, 1}};
  const auto result = whdr(Image(3, 3, 3, 1.0f), j);  // a place of 1 is the last pixel's
  ASSERT_TRUE(result);
  EXPECT_EQ(result->counted, 2);
  EXPECT_EQ(result->passed_over, 2);
  EXPECT_EQ(result->weight, 4);
  EXPECT_EQ(result->rate, 0.75);
}

TEST(Whdr, OnADisplaysValuesLargerDifferencesAreEqual) {
  Image image(2, 1, 1);
  image.data = {0.5f, 0.6f};  // 20 % apart; of v^(1/2.2) 8.6 %
  Judgements j;
  j.points = {{1, 0, 0, true}, {2, 0.5, 0, true}};
  j.comparisons = {{0, 1, Darker::Equal, 1}};
  EXPECT_EQ(whdr(image, j)->rate, 1);
  EXPECT_EQ(whdr(display_coded(image), j)->rate, 0);
  EXPECT_NEAR(display_coded(image).data[1], std::pow(0.6, 1 / 2.2), 1e-6);
  EXPECT_EQ(display_coded(Image(1, 1, 1, -1.0f)).data[0], 0);
}

}  // namespace
}  // namespace clerestory
