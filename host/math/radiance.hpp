// How errors of radiance are counted, wherever they are.
#pragma once

namespace clerestory {

/// What keeps relative errors and logarithms finite in the dark; pictures have their 95th percentile at 0.9.
/// The shipped light has learned with it, in its losses and its shells.
inline constexpr double kLightFloor = 0.01;

/// (answer - truth)^2 / (truth^2 + 0.01), of which relMSE is the mean.
inline double relative_square(double answer, double truth) {
  return (answer - truth) * (answer - truth) / (truth * truth + kLightFloor);
}

}  // namespace clerestory
