// Whether two means differ by more than chance (Welch 1947).
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

namespace clerestory {

/// A difference of two means with the squares of their standard errors, of so many values each.
struct Shift {
  double value = 0;
  double squares[2] = {0, 0};
  std::int64_t counts[2] = {2, 2};
};
/// The standard error of their sum, and the degrees that Satterthwaite gives it; nothing where there is no spread.
/// Counts are at least 2.
struct ErrorOfSum {
  double error = 0, degrees = 1;
};
std::optional<ErrorOfSum> error_of_sum(const std::vector<Shift>& shifts);
/// Welch's test that the mean over such differences is 0, by Student's t of as many degrees as Satterthwaite gives: the
/// two-sided p-value; nothing where there is no spread. Counts are at least 2.
std::optional<double> p_of_shifts(const std::vector<Shift>& shifts);

}  // namespace clerestory
