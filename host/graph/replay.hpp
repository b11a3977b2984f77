// The adjoint of an op that runs a body over chunks runs that body again. By these, beside being ops, ops say what of
// the first run need not be computed in the second.
#pragma once
#include <memory>

#include "host/graph/op.hpp"

namespace clerestory {

/// Outputs, of one batch item each, take long to compute and little memory to keep.
struct WorthKeeping {
  virtual ~WorthKeeping() = default;
};

/// Runs a body over chunks, and in it perhaps what the body of another node runs over the same chunks.
struct Chunked {
  virtual ~Chunked() = default;
  /// The node whose body is run again here, with the same inputs and draws; null: none.
  virtual const Node* replayed() const = 0;
  /// What `v` of this op's body is in the body of that node; no value where it is nothing there.
  virtual Value first_of(Value v) const = 0;
  /// All that a value of the body is, chunk after chunk.
  virtual Signature in_all_chunks(Value v) const = 0;
  /// The same op with those of some values as outputs behind its own, or as inputs that are not computed again.
  virtual std::unique_ptr<const Op> keeping(std::vector<Value> values) const = 0;
  virtual std::unique_ptr<const Op> given(std::vector<Value> values) const = 0;
};

}  // namespace clerestory
