// Sums, order statistics and the few distributions that tests and reports need. All in double.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace clerestory {

/// Running sum with Neumaier's compensation: error below 2 eps |sum| + O(n eps^2) sum|x|.
class CompensatedSum {
 public:
  void add(double value);
  double value() const { return sum_ + compensation_; }

 private:
  double sum_ = 0, compensation_ = 0;
};

/// Sums in a fixed order, compensated; of nothing: 0.
double sum(std::span<const float> values);
double sum(std::span<const double> values);

/// Throw usage_error on an empty span. Quantiles interpolate linearly between order statistics (position q (n-1)),
/// 0 <= q <= 1, and refuse NaN.
double mean(std::span<const float> values);
double mean(std::span<const double> values);
double quantile(std::span<const float> values, double q);
double quantile(std::span<const double> values, double q);
double median(std::span<const float> values);
double median(std::span<const double> values);

/// Sample standard deviation (n - 1), two passes; 0 for a single value.
double standard_deviation(std::span<const float> values);
double standard_deviation(std::span<const double> values);

/// Rec.709 luminance of linear colour.
inline double luminance(double r, double g, double b) { return 0.2126 * r + 0.7152 * g + 0.0722 * b; }
/// Quantile of the luminance of a planar 3-channel picture (channel, row, column); throws unless size % 3 == 0.
double luminance_quantile(std::span<const float> rgb, double q);
/// The factor by which a picture enters the nets: brings the 95th percentile of its luminance to 0.9. A picture whose
/// 95th percentile is not positive (black) has the factor 1.
double exposure_of(std::span<const float> rgb);
/// 99th percentile of the valid (positive, finite) depths: the unit of nets, of delta d and of thickness. Throws
/// usage_error naming `where` when no depth is valid.
double scene_scale(std::span<const float> depth, const std::string& where = "depth");

/// Standard normal distribution: the two-sided p-value P(|Z| >= |z|), accurate in the tails.
double normal_two_sided_p(double z);

/// Regularised incomplete gamma functions P(a, x) and Q(a, x) = 1 - P, a > 0, x >= 0: series below x = a + 1,
/// Lentz's continued fraction above (Abramowitz & Stegun 6.5.29, 6.5.31).
double gamma_p(double a, double x);
double gamma_q(double a, double x);
/// P(X <= x) and P(X >= x) of the chi-square distribution.
double chi_square_cdf(double x, double degrees);
double chi_square_p_value(double x, double degrees);

/// Student's t distribution of `degrees` >= 1: the two-sided p-value P(|T| >= |t|), to an absolute 1e-14, and the t
/// inside which a share (0 < share < 1) of |T| lies.
double student_two_sided_p(double t, int degrees);
double student_limit(double share, int degrees);

struct ChiSquareTest {
  double statistic = 0, p_value = 1;
  int degrees = 0, pooled = 0;  // cells pooled because they expect too few
};
/// Pearson's test of counts against expected counts; cells that expect fewer than `least` are pooled into one. A count
/// in a pool that expects nothing gives p = 0. Throws usage_error on unlike sizes or negative expectations.
ChiSquareTest chi_square_test(std::span<const double> observed, std::span<const double> expected, double least = 5);

/// Significance of one of `tests` independent tests so that together they err with probability `alpha` (Sidak 1967).
double sidak_significance(double alpha, double tests);

}  // namespace clerestory
