#include "host/math/welch.hpp"

#include <algorithm>
#include <cmath>

#include "host/math/statistics.hpp"

namespace clerestory {

std::optional<ErrorOfSum> error_of_sum(const std::vector<Shift>& shifts) {
  double variance = 0, parts = 0;
  for (const Shift& shift : shifts)
    for (int k = 0; k < 2; ++k) {
      variance += shift.squares[k];
      parts += shift.squares[k] * shift.squares[k] / static_cast<double>(shift.counts[k] - 1);
    }
  if (!(variance > 0)) return {};
  return ErrorOfSum{std::sqrt(variance), variance * variance / parts};
}

std::optional<double> p_of_shifts(const std::vector<Shift>& shifts) {
  const std::optional<ErrorOfSum> sum = error_of_sum(shifts);
  if (!sum) return {};
  double value = 0;
  for (const Shift& shift : shifts) value += shift.value;
  return student_two_sided_p(value / sum->error, std::max(1, static_cast<int>(sum->degrees)));
}

}  // namespace clerestory
