// States of a graph in a file, checkpoint or weights alike.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "experiments/weights/history.hpp"
#include "host/error.hpp"
#include "host/graph/plan.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

/// Names and shapes of the states that a graph has.
std::map<std::string, Shape> states_of(const Graph& graph);

std::vector<long> stored_shape(const Shape& shape);
std::string shape_text(const std::vector<long>& shape);  // "8x3x1x1"

/// A state that holds a NaN or Inf; `where` is its name.
struct NotFinite : Error {
  NotFinite(const std::string& state, const std::string& found)
      : Error(ErrorKind::Failed, "a state of the network is not finite; the file before stays", state, found),
        found_(found) {}
  const std::string& found() const { return found_; }  // the first such number, and where in the state

 private:
  std::string found_;
};
/// One state as a file has it, in float. Throws NotFinite.
StoredTensor stored_state(const States& states, const std::string& name);
/// The tensor `name` of a file. Throws usage_error naming `where` when there is none of this shape.
const StoredTensor& shaped_tensor(const TensorFile& file, const std::string& name, const Shape& shape,
                                  const std::string& where);
/// Sets a state to what the file holds. Throws what shaped_tensor() throws.
void set_state(States& states, const std::string& name, const Shape& shape, const TensorFile& file,
               const std::string& where);

/// What a file's metadata says of its training; without legs when it says nothing.
History stored_history(const TensorFile& file, const std::string& where);

}  // namespace clerestory
