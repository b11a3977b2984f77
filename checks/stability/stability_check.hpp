// Evaluates a case in float, twice, and in double at the same floats, and says what its row of the table is.
#pragma once
#include <cmath>

#include "checks/op_check.hpp"
#include "checks/stability/stability_case.hpp"

namespace clerestory {

/// What the errors of a case inside the documented domain may be.
inline constexpr double kStableValue = 1e-5, kStableGradient = 1e-4;

struct StabilityRow {
  long evaluations = 0;                    // of all values
  long inside = 0;                         // of these, in the documented domain
  long bad_values = 0, bad_gradients = 0;  // evaluations in float that are not finite
  double largest = 0;                      // value in float, by its magnitude
  /// 99.9th percentiles over the evaluations inside, of a case that lies outside over all, of |float - double| over
  /// |double|, vectors by their length; the largest of the case's values and of its gradients. NaN: not compared.
  double value_error = NAN, gradient_error = NAN;
  /// Samples that an op left out as not finite, and evaluations inside that are 0 or not finite in float alone.
  double dropped = 0;
  std::vector<std::string> faults = {};
};
StabilityRow check_stability(const StabilityCase& c, const CheckedDevices& devices);

}  // namespace clerestory
