#include "host/io/exposure.hpp"

#include <algorithm>

#include "host/math/statistics.hpp"

namespace clerestory {

double shown_exposure(const Image& photo) {
  const float most = *std::ranges::max_element(photo.data);
  const double factor = exposure_of(photo.data);
  const bool for_a_screen = (most <= 1 && most > 0.1f) || (factor >= 0.25 && factor <= 4);
  return for_a_screen ? 1 : factor;
}

}  // namespace clerestory
