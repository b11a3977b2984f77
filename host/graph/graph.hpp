// The graph: nodes in the order they were made. Define it once, compile it to plans, run those.
#pragma once
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "host/graph/op.hpp"
#include "host/graph/tensor.hpp"

namespace clerestory {

struct Node {
  int id = 0;
  Graph* graph = nullptr;
  std::unique_ptr<const Op> op;
  std::vector<Value> inputs;
  std::vector<Signature> outputs;
  std::uint32_t draws = 0;  // see Graph::draws

  Value value(int output = 0) const { return {const_cast<Node*>(this), output}; }
  const Shape& in_shape(int i) const { return inputs[static_cast<std::size_t>(i)].shape(); }
};

/// How a state starts: constant, or normal with the given deviation, keyed by the state's name and the seed alone.
struct Init {
  enum class Kind { Constant, Normal, Uniform } kind = Kind::Constant;
  double value = 0;  // the constant, the deviation, or the half width
  bool trainable = true;
  static Init constant(double v) { return {Kind::Constant, v, true}; }
  static Init normal(double deviation) { return {Kind::Normal, deviation, true}; }
  static Init uniform(double half_width) { return {Kind::Uniform, half_width, true}; }
  static Init fixed(double v) { return {Kind::Constant, v, false}; }  // running statistics, moments: not trained
};

class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  /// A tensor that every run is given.
  Value input(const std::string& name, const Shape& shape, Type type = Type::Real);
  /// A tensor that outlives runs. The same name twice is the same state.
  Value state(const std::string& name, const Shape& shape, const Init& init);
  Value constant(Tensor tensor);
  Value fill(const Shape& shape, double value) { return constant(Tensor(shape, value)); }

  /// Appends a node; its first output.
  Value add(std::unique_ptr<const Op> op, std::vector<Value> inputs);
  template <class T, class... Args>
  Value make(std::vector<Value> inputs, Args&&... args) {
    return add(std::make_unique<const T>(std::forward<Args>(args)...), std::move(inputs));
  }

  /// Nodes made from now on draw random numbers of their own, by `key`, in each run: two parts of a graph under unlike
  /// keys have nothing drawn in common. 0, as at first: by the run's seed alone. Adjoints draw what their nodes drew.
  void draws(std::uint32_t key) { draws_ = key; }
  std::uint32_t draws() const { return draws_; }

  const std::deque<Node>& nodes() const { return nodes_; }
  /// Trainable states in the order they were first named.
  std::vector<Value> parameters() const;
  std::vector<Value> states() const;
  /// Nodes that write states, in order.
  std::vector<Value> updates() const;
  /// A line for explain(): something this scene does not need was not built at all.
  void left_out(const std::string& what) { left_out_.push_back(what); }
  const std::vector<std::string>& what_was_left_out() const { return left_out_; }

 private:
  std::deque<Node> nodes_;
  std::map<std::string, Value> inputs_, states_;
  std::vector<std::string> left_out_;
  std::uint32_t draws_ = 0;
};

// Leaves. Plans know them by these types.
struct InputOp : NotDifferentiable {
  std::string input_name;
  Signature signature;
  InputOp(std::string n, Signature s) : input_name(std::move(n)), signature(s) {}
  std::string name() const override { return "input"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {signature}; }
  void launch(Launch&) const override {}
};
struct StateOp : NotDifferentiable {
  std::string state_name;
  Shape shape;
  Init init;
  StateOp(std::string n, Shape s, Init i) : state_name(std::move(n)), shape(s), init(i) {}
  std::string name() const override { return "state"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{shape, Type::Real}}; }
  void launch(Launch&) const override {}
};
/// The state that a value is. Throws Error when it is none.
const StateOp& state_of(const Value& value);

struct ConstantOp : NotDifferentiable {
  Tensor tensor;
  explicit ConstantOp(Tensor t) : tensor(std::move(t)) {}
  std::string name() const override { return "constant"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{tensor.shape, tensor.type()}}; }
  void launch(Launch&) const override {}
};

/// Gradients of `outputs`, weighted by `seeds`, with respect to each of `wrt`; the adjoints become nodes of the same
/// graph. A value that `outputs` does not depend on, or only behind a detached input, has an empty gradient. Throws
/// Error naming op and value when one would go through an op that has no rule for it (Slope::None).
std::vector<Value> gradient(std::span<const Value> outputs, std::span<const Value> seeds, std::span<const Value> wrt);
/// The same for one scalar loss (shape 1x1x1x1).
std::vector<Value> gradient(Value loss, std::span<const Value> wrt);

/// By node and output: whether gradients go from there to one of `wrt`, by rules or through ops that lack them.
class Dependence {
 public:
  Dependence(const Graph& graph, std::span<const Value> wrt);
  bool operator()(const Value& v) const;

 private:
  std::vector<std::vector<bool>> depends_;
};

/// a + b, elementwise: how gradients meet. (kernels/tensor/accumulate.cl)
Value accumulate(Value a, Value b);

}  // namespace clerestory
