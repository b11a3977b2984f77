#include "checks/stability/stability_check.hpp"

#include <algorithm>
#include <cfloat>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kBeyond = 1000;  // one in so many lies beyond the percentile

/// One evaluation in both precisions.
struct Pair {
  double difference = 0, size = 0;  // of the vectors float - double, and double
  bool finite = true, zero = true;  // in float
};

Pair pair_at(const Tensor& single, const Tensor& twin, int n, long at) {
  const Shape& s = single.shape;
  Pair p;
  for (int c = 0; c < s.c; ++c) {
    const auto i = static_cast<std::size_t>(n * s.item() + c * s.plane() + at);
    const double x = single.real[i], y = twin.real[i];
    p.finite = p.finite && std::isfinite(x), p.zero = p.zero && x == 0;
    p.difference = std::hypot(p.difference, x - y), p.size = std::hypot(p.size, y);
  }
  return p;
}

/// Relative to the twin, or to `least` where that is less.
double relative_error(const Pair& p, double least) {
  return std::isfinite(p.difference) ? p.difference / std::max(p.size, least) : INFINITY;
}

/// Below this an evaluation is not asked for its own digits: float has none left, or terms that cancel have not.
double least_size(const Evaluated& twin) {
  double least = FLT_MIN, squares = 0;
  if (!twin.sums) return least;
  for (const double x : twin.tensor.real) squares += x * x;
  return std::max(least, std::sqrt(squares * twin.tensor.shape.c / static_cast<double>(twin.tensor.real.size())));
}

double percentile(std::vector<double> errors) {
  if (errors.empty()) return 0;
  const auto at = errors.end() - 1 - static_cast<long>(errors.size() / kBeyond);
  std::ranges::nth_element(errors, at);
  return *at;
}

bool same_bits(const std::vector<Evaluated>& a, const std::vector<Evaluated>& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return std::ranges::equal(a, b, [&](const Evaluated& x, const Evaluated& y) {
    return std::ranges::equal(x.tensor.real, y.tensor.real, same) && x.tensor.integer == y.tensor.integer;
  });
}

class Check {
 public:
  Check(const StabilityCase& c, const CheckedDevices& devices) : case_(c), devices_(devices) {}

  StabilityRow row() {
    const Evaluations single = case_.evaluate(devices_.single, Precision::Single),
                      again = case_.evaluate(devices_.single, Precision::Single);
    if (!same_bits(single.values, again.values) || !same_bits(single.gradients, again.gradients))
      fault("two runs differ");
    const Evaluations twin = devices_.with_doubles ? case_.evaluate(*devices_.with_doubles, Precision::Double) : single;
    row_.dropped = single.dropped;
    for (const Evaluated& value : single.values)
      for (const double x : value.tensor.real) row_.largest = std::max(row_.largest, std::abs(x));
    const Worst value = compare(single.values, twin.values, row_.bad_values, true),
                gradient = compare(single.gradients, twin.gradients, row_.bad_gradients, false);
    if (devices_.with_doubles) row_.value_error = value.error, row_.gradient_error = gradient.error;
    judge(twin);
    if (case_.inside && devices_.with_doubles) {
      // A kernel that writes nothing but zeros would pass.
      if (value.compared == 0 && !case_.black) fault("all values are 0 in both precisions: nothing was compared");
      judge_error("value", value, kStableValue);
      judge_error("gradient", gradient, kStableGradient);
    }
    return row_;
  }

 private:
  template <class... Args>
  void fault(fmt::format_string<Args...> format, Args&&... args) {
    row_.faults.push_back(case_.label() + ": " + fmt::format(format, std::forward<Args>(args)...));
  }

  /// The largest percentile of the tensors, and which has it; NaN when there are none.
  struct Worst {
    double error = NAN;
    std::size_t at = 0;
    std::size_t compared = 0;  // evaluations, of all tensors
  };

  Worst compare(const std::vector<Evaluated>& single, const std::vector<Evaluated>& twin, long& bad, bool values) {
    Worst worst;
    for (std::size_t i = 0; i < single.size(); ++i) {
      const std::vector<double> errors = errors_of(single[i].tensor, twin[i], bad, values);
      worst.compared += errors.size();
      if (const double error = percentile(errors); !(error <= worst.error)) worst.error = error, worst.at = i;
    }
    return worst;
  }

  /// Of the evaluations that count. What is nothing in both precisions is right, and would hide what is not.
  std::vector<double> errors_of(const Tensor& single, const Evaluated& twin, long& bad, bool values) {
    std::vector<double> errors;
    std::size_t evaluation = 0;
    const double least = least_size(twin);
    for (int n = 0; n < single.shape.n; ++n)
      for (long at = 0; at < single.shape.plane(); ++at, ++evaluation) {
        const Pair p = pair_at(single, twin.tensor, n, at);
        const bool inside = case_.inside && (twin.inside.empty() || twin.inside[evaluation]);
        bad += !p.finite;
        if (values) ++row_.evaluations, row_.inside += inside;
        if (values && inside && (!p.finite || (p.zero && p.size > FLT_MIN))) ++row_.dropped;
        if ((inside || !case_.inside) && (p.size > 0 || !p.zero)) errors.push_back(relative_error(p, least));
      }
    return errors;
  }

  void judge(const Evaluations& twin) {
    if (row_.bad_values > 0) fault("{} of {} values are not finite", row_.bad_values, row_.evaluations);
    if (row_.largest > case_.most) fault("a value is {:.3g}, allowed {:.3g}", row_.largest, case_.most);
    if (row_.bad_gradients > 0) fault("{} gradients are not finite", row_.bad_gradients);
    if (!case_.inside) {
      if (row_.dropped != twin.dropped)
        fault("{} samples are counted as dropped, {} in double", row_.dropped, twin.dropped);
      return;
    }
    if (row_.dropped > 0) fault("{} samples are dropped", row_.dropped);
  }

  void judge_error(const char* what, const Worst& worst, double bar) {
    if (worst.error > bar)
      fault("{} {} is wrong by {:.2g} (99.9th percentile, relative), allowed {:.2g}", what, worst.at, worst.error, bar);
  }

  const StabilityCase& case_;
  const CheckedDevices& devices_;
  StabilityRow row_;
};

}  // namespace

StabilityRow check_stability(const StabilityCase& c, const CheckedDevices& devices) {
  try {
    return Check(c, devices).row();
  } catch (const Error& e) {
    StabilityRow row;
    row.faults.push_back(c.label() + ": " + e.what());
    return row;
  }
}

}  // namespace clerestory
