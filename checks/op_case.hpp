// One description of an op drives all that is checked of it (op_check.hpp): values, precision, gradients, determinism,
// strides. checks/<group>/<stem>.cpp declares the cases of an op with OP_CASES; nothing else names them.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host/graph/graph.hpp"

namespace clerestory {

using Tensors = std::map<std::string, Tensor>;
using Values = std::map<std::string, Value>;

struct OpCase {
  std::string stem = {};   // the op's stem: "group_norm"
  std::string label = {};  // tells the cases of one stem apart; letters, digits and _
  /// Kernels that this case must be seen to launch, in single and in double precision.
  std::vector<std::string> kernels = {};
  /// Reals of local memory (seven eighths of a device's) that they need: others stand in where there is less.
  std::size_t local_elements = 0;
  /// Those without which the op refuses to run: nothing stands in.
  std::size_t least_local_elements = 0;
  /// Work-items of a group that they need.
  std::size_t group = 1;
  /// Reals that must fit into one piece of the device's memory.
  std::size_t piece_elements = 0;
  /// Those it is seen to launch under --gemm clblast, of an op that then has another body.
  std::vector<std::string> product_kernels = {};
  Tensors inputs = {};
  Tensors states =
      {};  // values, before the run, of the states that build() names; they are rounded to float, as inputs are
  std::function<std::vector<Value>(Graph&, const Values&)> build = {};
  /// The same in plain C++ in double, without a look at the kernel: outputs in order, then, when the op has updates,
  /// the new values of `states` in the order of their names. Gets inputs and states in one map.
  std::function<std::vector<Tensor>(const Tensors&)> reference = {};

  /// |value - reference| <= roundings * epsilon * magnitude. Roundings: about the longest chain of operations behind
  /// one element (a sum of n terms counts n, or log2 n when it is a tree). Magnitude: of the terms that are summed;
  /// 0 takes the largest |reference| of the output.
  double roundings = 16, magnitude = 0;

  /// Inputs (or states) whose gradients are compared with central differences in double; if none, say why.
  std::vector<std::string> differentiate = {};
  std::string no_gradient = {};
  double step = 1e-5;                // of the central difference: error step^2 |f'''| / 6 + epsilon |f| / step
  double gradient_tolerance = 1e-7;  // relative to the largest gradient of that input
  double gradient_roundings = 0;     // float against double gradient; 0: four times `roundings`
  int differences = 150;             // elements of each input that are moved (all when it has fewer)

  std::uint32_t seed = 1;  // of the run
  /// False for one more build of kernels that other cases and tests run: `clerestory check` alone runs it.
  bool in_tests = true;

  std::string name() const { return stem + "/" + label; }
};

/// Reproducible values in [low, high).
Tensor random_tensor(Shape shape, std::uint64_t seed, double low = -1, double high = 1);
Tensor random_ints(Shape shape, std::uint64_t seed, int low, int high);

/// All cases of the program, in no promised order; they are made at the first call.
const std::vector<OpCase>& declared_cases();
/// Before main(): `make` gives the cases of one op.
bool declare_cases(std::vector<OpCase> (*make)());

}  // namespace clerestory

/// OP_CASES(group_norm) { return {OpCase{...}, ...}; }
#define OP_CASES(name)                                                                          \
  static std::vector<::clerestory::OpCase> op_cases_of_##name();                                \
  static const bool op_cases_declared_##name = ::clerestory::declare_cases(op_cases_of_##name); \
  static std::vector<::clerestory::OpCase> op_cases_of_##name()
