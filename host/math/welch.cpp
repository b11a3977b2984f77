#include "host/math/welch.hpp"

#include <algorithm>
#include <cmath>

#include "host/math/statistics.hpp"

namespace clerestory {

std::optional<double> p_of_shifts(const std::vector<Shift>& shifts) {
  double value = 0, variance = 0, parts = 0;
  for (const Shift& shift : shifts) {
    value += shift.value;
    for (int k = 0; k < 2; ++k) {
      variance += shift.squares[k];
      parts += shift.squares[k] * shift.squares[k] / static_cast<double>(shift.counts[k] - 1);
    }
  }
  if (!(variance > 0)) return {};
  return student_two_sided_p(value / std::sqrt(variance), std::max(1, static_cast<int>(variance * variance / parts)));
}

}  // namespace clerestory
