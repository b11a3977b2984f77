// The largest of many errors.
#pragma once
#include <cmath>

namespace clerestory {

/// The larger of two errors, NaN where either is: std::max keeps what stands first.
inline double worse(double worst, double error) { return std::isnan(worst) || error <= worst ? worst : error; }

}  // namespace clerestory
