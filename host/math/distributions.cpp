// Distribution functions of statistics.hpp.
#include <cmath>
#include <limits>
#include <numbers>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

// x^a e^-x / Gamma(a): the factor both expansions share, through logarithms as a may be large.
double gamma_factor(double a, double x) { return std::exp(a * std::log(x) - x - std::lgamma(a)); }

// The number of terms of both expansions grows like sqrt(a); this leaves room up to a = 1e8.
int term_limit(double a) { return 200 + static_cast<int>(20 * std::sqrt(a)); }

[[noreturn]] void no_convergence(double a, double x) {
  throw Error(ErrorKind::Failed, "no convergence", "incomplete gamma function", fmt::format("a = {}, x = {}", a, x));
}

// P by the power series, x < a + 1.
double gamma_series(double a, double x) {
  double term = 1 / a, total = term;
  for (int n = 1; n <= term_limit(a); ++n) {
    term *= x / (a + n);
    total += term;
    if (term < total * epsilon) return total * gamma_factor(a, x);
  }
  no_convergence(a, x);
}

// Q by the continued fraction in Lentz's form, x >= a + 1.
double gamma_fraction(double a, double x) {
  constexpr double tiny = 1e-300;
  double b = x + 1 - a, c = 1 / tiny, d = 1 / b, value = d;
  for (int n = 1; n <= term_limit(a); ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    if (std::abs(d) < tiny) d = tiny;
    c = b + an / c;
    if (std::abs(c) < tiny) c = tiny;
    d = 1 / d;
    value *= d * c;
    if (std::abs(d * c - 1) < 2 * epsilon) return value * gamma_factor(a, x);
  }
  no_convergence(a, x);
}

void check_arguments(double a, double x) {
  if (!(a > 0) || !(x >= 0) || std::isinf(a))
    throw usage_error("argument out of range", "incomplete gamma function", fmt::format("a = {}, x = {}", a, x),
                      "a > 0, x >= 0");
}

}  // namespace

double normal_two_sided_p(double z) { return std::erfc(std::abs(z) / std::sqrt(2.0)); }

double gamma_p(double a, double x) {
  check_arguments(a, x);
  if (x == 0) return 0;
  if (std::isinf(x)) return 1;
  return x < a + 1 ? gamma_series(a, x) : 1 - gamma_fraction(a, x);
}

double gamma_q(double a, double x) {
  check_arguments(a, x);
  if (x == 0) return 1;
  if (std::isinf(x)) return 0;
  return x < a + 1 ? 1 - gamma_series(a, x) : gamma_fraction(a, x);
}

double chi_square_cdf(double x, double degrees) { return x <= 0 ? 0 : gamma_p(degrees / 2, x / 2); }
double chi_square_p_value(double x, double degrees) { return x <= 0 ? 1 : gamma_q(degrees / 2, x / 2); }

// Finite sums in the angle atan(t / sqrt(degrees)): Abramowitz & Stegun 26.7.3, 26.7.4.
double student_two_sided_p(double t, int degrees) {
  if (degrees < 1 || std::isnan(t))
    throw usage_error("argument out of range", "Student's t", fmt::format("t = {}, degrees = {}", t, degrees),
                      "1 degree or more");
  const double angle = std::atan2(std::abs(t), std::sqrt(static_cast<double>(degrees)));
  const double cosine = std::cos(angle), square = cosine * cosine;
  const bool odd = degrees % 2 == 1;
  double term = odd ? cosine : 1, total = degrees == 1 ? 0 : term;
  for (int k = 1; k <= (odd ? (degrees - 3) / 2 : degrees / 2 - 1); ++k) {
    term *= square * (odd ? 2.0 * k / (2 * k + 1) : (2 * k - 1) / (2.0 * k));
    total += term;
  }
  const double inside = odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * total) : std::sin(angle) * total;
  return 1 - inside;
}

double student_limit(double share, int degrees) {
  if (!(share > 0 && share < 1))
    throw usage_error("argument out of range", "Student's t", fmt::format("share = {}", share), "between 0 and 1");
  double low = 0, high = 1;
  while (student_two_sided_p(high, degrees) > 1 - share) high *= 2;
  while (high - low > 4 * epsilon * high) {
    const double middle = 0.5 * (low + high);
    (student_two_sided_p(middle, degrees) > 1 - share ? low : high) = middle;
  }
  return high;
}

}  // namespace clerestory
