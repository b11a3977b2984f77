// What is evaluated to ask whether a build is numerically stable on a device: declared cases by group, each a small
// graph of ops at inputs that are stiff or extreme, with the domain that docs/stability.md promises.
#pragma once
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "checks/op_case.hpp"
#include "host/cl/device.hpp"

namespace clerestory {

/// A tensor {n, c, h, w} is n h w evaluations, each a vector of c channels: a colour, a direction, a pixel's material.
struct Evaluated {
  Tensor tensor;
  std::vector<char> inside = {};  // of the documented domain, one an evaluation; empty: all
  /// Sums of terms of either sign, which may leave next to nothing: errors are relative to the root mean square of all.
  bool sums = false;
};

/// What a case gives in one precision.
struct Evaluations {
  std::vector<Evaluated> values, gradients;
  double dropped = 0;  // samples that an op itself left out as not finite
};

struct StabilityCase {
  std::string group = {}, name = {};
  bool inside = true;  // the documented domain; what lies outside has to be finite and counted, no more
  std::function<Evaluations(const Device&, Precision)> evaluate = {};
  double most = INFINITY;  // that a value may be
  bool black = false;      // the right answer is 0 everywhere

  std::string label() const { return group + "/" + name; }
};

/// All cases of the program, group by group; they are made at the first call.
const std::vector<StabilityCase>& stability_cases();

// The groups.
std::vector<StabilityCase> brdf_stability();
std::vector<StabilityCase> sample_stability();
std::vector<StabilityCase> uncertainty_stability();
std::vector<StabilityCase> field_stability();
std::vector<StabilityCase> ray_stability();
std::vector<StabilityCase> loss_stability();
std::vector<StabilityCase> norm_stability();
std::vector<StabilityCase> optimiser_stability();
std::vector<StabilityCase> hypernetwork_stability();
std::vector<StabilityCase> scene_stability();

/// A small graph of ops as a case. `build` gives what is compared, under names; the gradients are those of the values
/// that are `weighed`, by constants between 0.5 and 1.5, by the inputs in `differentiate`.
struct Compared {
  Value value;
  bool weighed = true;
};
struct Formula {
  Tensors inputs = {};
  std::function<std::vector<Compared>(Graph&, const Values&)> build = {};
  std::vector<std::string> differentiate = {};
  Tensors states = {};  // values, before the run, of states that build() names; what it makes of them are values, too
  std::uint32_t seed = 1;
  /// Of a ray tensor only the first sample of a pixel is weighed, so that a pixel's gradient is that of one ray.
  bool first_ray = false;
};
/// Inputs and states, also those that start from the seed, are rounded to float whatever the precision.
Evaluations evaluate_formula(const Formula& formula, const Device& device, Precision precision);
/// The case whose evaluations are those of the formula, inside the domain.
StabilityCase case_of(const std::string& group, const std::string& name, const Formula& formula);
/// The same out of the documented domain.
StabilityCase outside(StabilityCase c);

/// `count` numbers whose logarithms are spread evenly from those of `low` to `high`, both included, in an order that
/// knows nothing of neighbours.
std::vector<double> spread_logarithms(int count, double low, double high, std::uint64_t seed);

}  // namespace clerestory
