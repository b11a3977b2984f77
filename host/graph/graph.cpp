#include "host/graph/graph.hpp"

#include <algorithm>
#include <limits>

namespace clerestory {

const Shape& Value::shape() const { return node->outputs[static_cast<std::size_t>(output)].shape; }
Type Value::type() const { return node->outputs[static_cast<std::size_t>(output)].type; }
Graph& Value::graph() const { return *node->graph; }

std::vector<Value> NotDifferentiable::adjoint(const Node&, std::span<const Value>) const {
  throw Error(ErrorKind::Failed, "is not differentiable", "op " + name());
}

Cost Op::cost(const Node& node) const {
  double elements = 0;
  for (const Value& v : node.inputs) elements += static_cast<double>(v.shape().count());
  for (const Signature& s : node.outputs) elements += static_cast<double>(s.shape.count());
  return {0, 4 * elements};
}

namespace {

/// Kernels count the elements of a batch item in 32 bits.
void check_size(const Shape& s, const std::string& op) {
  if (s.n < 1 || s.c < 1 || s.h < 1 || s.w < 1)
    throw Error(ErrorKind::Failed, "a tensor without elements", "op " + op, s.text());
  if (s.item() > std::numeric_limits<int>::max())
    throw Error(ErrorKind::Failed, "a tensor is too large", "op " + op, s.text(), "items of less than 2^31 elements");
}

}  // namespace

Value Graph::add(std::unique_ptr<const Op> op, std::vector<Value> inputs) {
  for (const Value& v : inputs)
    if (!v || v.node->graph != this)
      throw Error(ErrorKind::Failed, "an input is empty or of another graph", "op " + op->name());
  Node& node = nodes_.emplace_back();
  node.id = static_cast<int>(nodes_.size()) - 1;
  node.graph = this;
  node.draws = draws_;
  try {
    node.outputs = op->infer(inputs);
    for (const Signature& s : node.outputs) check_size(s.shape, op->name());
  } catch (...) {
    nodes_.pop_back();
    throw;
  }
  node.op = std::move(op);
  node.inputs = std::move(inputs);
  return node.value();
}

Value Graph::input(const std::string& name, const Shape& shape, Type type) {
  if (inputs_.count(name)) throw Error(ErrorKind::Failed, "this graph has an input of that name already", name);
  return inputs_[name] = make<InputOp>({}, name, Signature{shape, type});
}

Value Graph::state(const std::string& name, const Shape& shape, const Init& init) {
  if (auto found = states_.find(name); found != states_.end()) {
    if (!(found->second.shape() == shape))
      throw Error(ErrorKind::Failed, "a state is asked for with two shapes", name, shape.text(),
                  found->second.shape().text());
    return found->second;
  }
  return states_[name] = make<StateOp>({}, name, shape, init);
}

Value Graph::constant(Tensor tensor) { return make<ConstantOp>({}, std::move(tensor)); }

const StateOp& state_of(const Value& value) {
  const auto* state = dynamic_cast<const StateOp*>(value.node->op.get());
  if (state == nullptr) throw Error(ErrorKind::Failed, "is no state", "op " + value.node->op->name());
  return *state;
}

std::vector<Value> Graph::states() const {
  std::vector<Value> found;
  for (const Node& node : nodes_)
    if (dynamic_cast<const StateOp*>(node.op.get())) found.push_back(node.value());
  return found;
}

std::vector<Value> Graph::parameters() const {
  std::vector<Value> found = states();
  std::erase_if(found, [](const Value& v) { return !state_of(v).init.trainable; });
  return found;
}

std::vector<Value> Graph::updates() const {
  std::vector<Value> found;
  for (const Node& node : nodes_)
    if (!node.op->writes().empty()) found.push_back(node.value());
  return found;
}

}  // namespace clerestory
