#include "experiments/weights/stored_states.hpp"

namespace clerestory {

std::map<std::string, Shape> states_of(const Graph& graph) {
  std::map<std::string, Shape> states;
  for (const Value& v : graph.states()) states[state_of(v).state_name] = v.shape();
  return states;
}

std::vector<long> stored_shape(const Shape& s) { return {s.n, s.c, s.h, s.w}; }

std::string shape_text(const std::vector<long>& shape) { return fmt::format("{}", fmt::join(shape, "x")); }

StoredTensor stored_state(const States& states, const std::string& name) {
  const Tensor tensor = states.get(name);
  StoredTensor stored(stored_shape(tensor.shape), tensor.floats());
  if (const std::string found = not_finite(stored); !found.empty()) throw NotFinite(name, found);
  return stored;
}

const StoredTensor& shaped_tensor(const TensorFile& file, const std::string& name, const Shape& shape,
                                  const std::string& where) {
  const StoredTensor& stored = file.get(name, where);
  if (stored.shape != stored_shape(shape))
    throw usage_error("a tensor has another shape than the network", where + ": " + name, shape_text(stored.shape),
                      shape_text(stored_shape(shape)));
  return stored;
}

void set_state(States& states, const std::string& name, const Shape& shape, const TensorFile& file,
               const std::string& where) {
  states.set(name, Tensor(shape, shaped_tensor(file, name, shape, where).floats(where + ": " + name)));
}

History stored_history(const TensorFile& file, const std::string& where) {
  const auto found = file.metadata.find("history");
  return found == file.metadata.end() ? History{} : history_from_json(found->second, where);
}

}  // namespace clerestory
