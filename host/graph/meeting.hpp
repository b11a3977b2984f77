// Where gradients of a value meet, gradient() adds them. Adjoints whose outputs can be added in a cheaper way than one
// by one say so by these, beside being ops.
#pragma once
#include <memory>

#include "host/graph/op.hpp"

namespace clerestory {

/// Output 0 is the input put into a larger tensor of zeros. gradient() lets such terms wait for each other.
struct Placing {
  virtual ~Placing() = default;
  /// The sum of output 0 of several nodes of such ops; no value where there is no cheaper way.
  virtual Value sum_of(std::span<const Value> terms) const = 0;
};

/// Output 0 can take a term while it is written: that saves a pass over memory.
struct Adding {
  virtual ~Adding() = default;
  /// The same op with one more input at the end, which is added to output 0; null where it has one already.
  virtual std::unique_ptr<const Op> adding() const = 0;
};

}  // namespace clerestory
