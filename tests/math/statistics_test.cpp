// Sums, order statistics and distribution functions against closed forms and tabulated values.
#include "host/math/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "host/error.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
using Doubles = std::vector<double>;
using Floats = std::vector<float>;

TEST(Statistics, CompensatedSum) {
  // Naive summation gives 0.
  EXPECT_EQ(sum(Doubles{1, 1e100, 1, -1e100}), 2);
  EXPECT_EQ(sum(Doubles{}), 0);
  Doubles tenths(1000000, 0.1);
  // The exact sum of the doubles nearest to 0.1, rounded: 1e6 * 0.1 rounds to 1e5 exactly.
  EXPECT_EQ(sum(tenths), 100000.0);
  double naive = 0;
  for (double v : tenths) naive += v;
  EXPECT_NE(naive, 100000.0) << "the case would not test compensation";
  EXPECT_EQ(sum(Floats{1.5f, 2.5f}), 4);
}

TEST(Statistics, MomentsAndQuantiles) {
  const Doubles values{4, 1, 3, 2};
  EXPECT_EQ(mean(values), 2.5);
  EXPECT_EQ(median(values), 2.5);
  EXPECT_EQ(median(Doubles{5, 1, 3}), 3);
  EXPECT_EQ(quantile(values, 0), 1);
  EXPECT_EQ(quantile(values, 1), 4);
  EXPECT_NEAR(quantile(values, 0.9), 3.7, 8 * eps);
  EXPECT_EQ(median(Floats{7}), 7);
  EXPECT_NEAR(standard_deviation(values), std::sqrt(5.0 / 3), 4 * eps);
  EXPECT_EQ(standard_deviation(Doubles{3}), 0);
  // Two passes: a large offset does not cancel.
  EXPECT_NEAR(standard_deviation(Doubles{1e9, 1e9 + 1, 1e9 + 2}), 1, 8 * eps);
  EXPECT_EQ(quantile(Floats{1, 1, 1, HUGE_VALF}, 0.5), 1);
}

TEST(Statistics, RefusesWhatHasNoAnswer) {
  EXPECT_THROW(mean(Doubles{}), Error);
  EXPECT_THROW(median(Floats{}), Error);
  EXPECT_THROW(standard_deviation(Doubles{}), Error);
  EXPECT_THROW(quantile(Doubles{1}, 1.5), Error);
  EXPECT_THROW(quantile(Doubles{1}, std::nan("")), Error);
  EXPECT_THROW(quantile(Doubles{1, std::nan("")}, 0.5), Error);
  EXPECT_THROW(luminance_quantile(Floats{1, 2}, 0.5), Error);
}

TEST(Statistics, LuminanceAndExposure) {
  EXPECT_NEAR(luminance(1, 1, 1), 1, 2 * eps);
  // Planar: 21 grey pixels of 0, 1, ..., 20; the 95th percentile is 19.
  Floats picture;
  for (int channel = 0; channel < 3; ++channel)
    for (int i = 0; i <= 20; ++i) picture.push_back(static_cast<float>(i));
  EXPECT_NEAR(luminance_quantile(picture, 0.95), 19, 19 * 4 * std::numeric_limits<float>::epsilon());
  EXPECT_NEAR(exposure_of(picture), 0.9 / 19, 0.05 * 8 * std::numeric_limits<float>::epsilon());
  // Channels are weighted, and taken from planes: blue alone.
  EXPECT_NEAR(luminance_quantile(Floats{0, 0, 0, 0, 1, 1}, 0.5), 0.0722, 0.0722 * kFloatRounding);
  EXPECT_EQ(exposure_of(Floats(12, 0.0f)), 1) << "black";
}

TEST(Statistics, SceneScaleIgnoresHoles) {
  Floats depth{0, -1, HUGE_VALF, std::nanf("")};
  for (int i = 0; i <= 100; ++i) depth.push_back(1 + 0.01f * static_cast<float>(i));
  // Of 0.01, of 99 times it, and of the sum, which is below 2.
  EXPECT_NEAR(scene_scale(depth), 1.99, (1 + 1 + 2) * kFloatRounding);
  try {
    scene_scale(Floats{0, 0}, "depth.exr");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(error.what()).find("depth.exr"), std::string::npos);
  }
}

TEST(Statistics, NormalDistribution) {
  EXPECT_EQ(normal_two_sided_p(0), 1);
  EXPECT_NEAR(normal_two_sided_p(-1.959963984540054), 0.05, 4 * eps);
  // Abramowitz & Stegun table 26.2: Q(10) = 7.61985 e-24; the tail must not be 1 - 1.
  // exp(-x^2 / 2) has twice the relative error of x as often as the exponent, 50, says; erfc adds a few units.
  EXPECT_NEAR(normal_two_sided_p(-10) / 2 / 7.619853024160527e-24, 1, (2 * 50 + 4) * eps);
}

// exp(a log x - x - lgamma a) has relative error eps * |exponent|.
double gamma_rounding(double x) { return 64 * eps * (1 + x); }

TEST(Statistics, IncompleteGammaAgainstClosedForms) {
  for (double x : {1e-8, 0.01, 0.5, 1.0, 1.5, 3.0, 10.0, 50.0, 300.0}) {
    const double tolerance = gamma_rounding(x);
    EXPECT_NEAR(gamma_q(0.5, x) / std::erfc(std::sqrt(x)), 1, tolerance) << x;
    EXPECT_NEAR(gamma_p(0.5, x) / std::erf(std::sqrt(x)), 1, tolerance) << x;
    EXPECT_NEAR(gamma_p(1, x) / -std::expm1(-x), 1, tolerance) << x;
    // Q(n, x) is the Poisson distribution: sum over k < n of e^-x x^k / k!.
    for (int n : {2, 5, 40}) {
      double term = std::exp(-x), poisson = term;
      for (int k = 1; k < n; ++k) poisson += term *= x / k;
      EXPECT_NEAR(gamma_q(n, x) / poisson, 1, tolerance * (1 + n)) << n << " " << x;
    }
  }
  for (double a : {0.1, 2.0, 1e4, 1e6})
    for (double ratio : {0.9, 0.999, 1.0, 1.001, 1.1})
      EXPECT_NEAR(gamma_p(a, a * ratio) + gamma_q(a, a * ratio), 1, 4 * eps) << a << " " << ratio;
  // Large a, beside the crossing: P(a, a) = 1/2 + 1/(3 sqrt(2 pi a)) + O(a^-3/2). The exponent of
  // a half is made of terms up to 1.4e7: four roundings of such.
  EXPECT_NEAR(gamma_p(1e6, 1e6), 0.5 + 1 / (3 * std::sqrt(2 * M_PI * 1e6)), 0.5 * 4 * eps * 1.4e7);
  EXPECT_EQ(gamma_p(2, 0), 0);
  EXPECT_EQ(gamma_q(2, 0), 1);
  EXPECT_EQ(gamma_q(2, HUGE_VAL), 0);
  EXPECT_EQ(gamma_p(2, HUGE_VAL), 1);
  for (auto [a, x] : {std::pair{0.0, 1.0}, {-1.0, 1.0}, {1.0, -1.0}, {std::nan(""), 1.0}, {1.0, std::nan("")}})
    EXPECT_THROW(gamma_p(a, x), Error);
}

TEST(Statistics, ChiSquareTable) {
  // Percentage points at p = 0.05 for 1, 10 and 100 degrees.
  EXPECT_NEAR(chi_square_p_value(3.841458820694124, 1), 0.05, 0.05 * gamma_rounding(2));
  EXPECT_NEAR(chi_square_p_value(18.307038053275146, 10), 0.05, 0.05 * gamma_rounding(9));
  EXPECT_NEAR(chi_square_p_value(124.34211340400407, 100), 0.05, 0.05 * gamma_rounding(62));
  EXPECT_NEAR(chi_square_cdf(18.307038053275146, 10), 0.95, 0.05 * gamma_rounding(9) + eps);
  EXPECT_EQ(chi_square_p_value(0, 3), 1);
  EXPECT_EQ(chi_square_cdf(-1, 3), 0);
}

TEST(Statistics, StudentsDistribution) {
  // Closed forms of one and two degrees, tabulated points of others, the normal distribution far out.
  for (const double t : {0.0, 0.3, -1.0, 4.0, 60.0}) {
    EXPECT_NEAR(student_two_sided_p(t, 1), 1 - 2 / M_PI * std::atan(std::abs(t)), 8 * eps);
    EXPECT_NEAR(student_two_sided_p(t, 2), 1 - std::abs(t) / std::sqrt(2 + t * t), 8 * eps);
  }
  // Tables have six decimals.
  EXPECT_NEAR(student_limit(0.95, 3), 3.182446, 5e-7);
  EXPECT_NEAR(student_limit(0.95, 4), 2.776445, 5e-7);
  EXPECT_NEAR(student_limit(0.95, 10), 2.228139, 5e-7);
  EXPECT_NEAR(student_limit(0.99, 5), 4.032143, 5e-7);
  // Against the normal distribution: p grows by phi(z) (z^3 + z) / 2 / degrees = 6.6e-8, to first order. What is left
  // is the second, 1.4e-12, and a rounding of cos^2, of which the 1e5 terms that count are powers.
  EXPECT_NEAR(student_two_sided_p(3, 1000000), normal_two_sided_p(3) + 0.0044318 * 30 / 2 / 1e6,
              1.4e-12 + 1e5 * kDoubleRounding);
  for (const int degrees : {1, 2, 7, 15, 30})
    // A difference from 1 of up to 15 terms, two roundings each.
    EXPECT_NEAR(student_two_sided_p(student_limit(0.9975, degrees), degrees), 0.0025, 2 * 15 * eps);
  EXPECT_THROW(student_two_sided_p(1, 0), Error);
  EXPECT_THROW(student_limit(1, 5), Error);
}

TEST(Statistics, ChiSquareTestPoolsAndDetects) {
  // By hand: (8-10)^2/10 + (12-10)^2/10 + pool (4-4)^2/4.
  const ChiSquareTest fair = chi_square_test(Doubles{8, 12, 1, 3}, Doubles{10, 10, 2, 2});
  EXPECT_NEAR(fair.statistic, 0.8, 4 * eps);
  EXPECT_EQ(fair.degrees, 2);
  EXPECT_EQ(fair.pooled, 2);
  EXPECT_NEAR(fair.p_value, std::exp(-0.4), 8 * eps) << "two degrees: exp(-x/2)";
  EXPECT_EQ(chi_square_test(Doubles{50, 50, 1}, Doubles{50, 51, 0}).p_value, 0) << "an impossible count";
  EXPECT_LT(chi_square_test(Doubles{900, 1100}, Doubles{1000, 1000}).p_value, 1e-4);
  EXPECT_THROW(chi_square_test(Doubles{1}, Doubles{1, 2}), Error);
  EXPECT_THROW(chi_square_test(Doubles{1}, Doubles{-1}), Error);

  // Under the hypothesis p-values are uniform: of 400 tests with 9 degrees, 5 % +- 4 sigma fall below 0.05.
  std::mt19937 random(3);
  std::uniform_int_distribution<int> cell(0, 9);
  int rejected = 0;
  for (int t = 0; t < 400; ++t) {
    Doubles observed(10, 0.0);
    for (int i = 0; i < 1000; ++i) observed[static_cast<std::size_t>(cell(random))] += 1;
    rejected += chi_square_test(observed, Doubles(10, 100.0)).p_value < 0.05;
  }
  EXPECT_NEAR(rejected, 20, 4 * std::sqrt(400 * 0.05 * 0.95));
}

TEST(Statistics, Sidak) {
  EXPECT_NEAR(sidak_significance(0.05, 1), 0.05, 4 * eps);
  EXPECT_NEAR(1 - std::pow(1 - sidak_significance(0.01, 100), 100), 0.01, 100 * eps);  // 1 - s is rounded
  EXPECT_NEAR(sidak_significance(1e-12, 1000) / 1e-15, 1, 1e-12) << "no cancellation, and half of alpha more";
}

}  // namespace
}  // namespace clerestory
