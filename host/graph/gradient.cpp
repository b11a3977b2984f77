// Reverse mode: walks the nodes backwards and asks each for its adjoint, which are nodes of the same graph.
#include <algorithm>
#include <map>

#include "host/graph/graph.hpp"
#include "host/graph/meeting.hpp"

namespace clerestory {
namespace {

/// y = a + b.
struct AccumulateOp : Op {
  std::string name() const override { return "accumulate"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (!(in[0].shape() == in[1].shape()))
      throw Error(ErrorKind::Failed, "shapes differ", "accumulate", in[1].shape().text(), in[0].shape().text());
    return {{in[0].shape(), Type::Real}};
  }
  std::vector<Value> adjoint(const Node&, std::span<const Value> g) const override { return {g[0], g[0]}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    l.run("tensor/accumulate.cl", "accumulate",
          Range::of2(static_cast<std::size_t>(s.item()), static_cast<std::size_t>(s.n)), l.in(0), l.in(1), l.out(),
          static_cast<int>(s.item()));
  }
  Cost cost(const Node& node) const override {
    const double count = static_cast<double>(node.outputs[0].shape.count());
    return {count, 12 * count};
  }
  int overwrites() const override { return 0; }
};

/// The gradient of a value, from each of those who read it.
class Arrivals {
 public:
  /// `unread`: nothing else reads g, so that its node may be changed.
  void add(Value g, bool unread) {
    if (placing(g))
      placed_.push_back(g);
    else if (!sum_)
      sum_ = g;
    else if (!unread || !add_inside(g))
      sum_ = accumulate(sum_, g);
  }

  Value total() {
    if (placed_.size() > 1)
      if (const Value together = placing(placed_[0])->sum_of(placed_)) placed_ = {together};
    for (const Value& g : placed_) sum_ = sum_ ? accumulate(sum_, g) : g;
    placed_.clear();
    return sum_;
  }

 private:
  static const Placing* placing(const Value& g) {
    return g.output == 0 ? dynamic_cast<const Placing*>(g.node->op.get()) : nullptr;
  }

  /// Has g's own node add the sum so far, if it can.
  bool add_inside(Value g) {
    if (g.output != 0 || sum_.node->id >= g.node->id) return false;
    const auto* op = dynamic_cast<const Adding*>(g.node->op.get());
    std::unique_ptr<const Op> adding = op ? op->adding() : nullptr;
    if (!adding) return false;
    g.node->op = std::move(adding);
    g.node->inputs.push_back(sum_);
    sum_ = g;
    return true;
  }

  Value sum_;
  std::vector<Value> placed_;
};

/// Whether g was made by the adjoint that gave `leaving`, whose first node is `first`, for one input, and is read by
/// none of its other nodes.
bool is_unread(const Graph& graph, Value g, std::span<const Value> leaving, int first) {
  if (g.node->id < first || std::ranges::count(leaving, g) != 1) return false;
  for (std::size_t id = static_cast<std::size_t>(g.node->id) + 1; id < graph.nodes().size(); ++id)
    if (std::ranges::count(graph.nodes()[id].inputs, g) > 0) return false;
  return true;
}

/// What an adjoint adds to a graph draws what its node drew.
class DrawsOf {
 public:
  explicit DrawsOf(const Node& node) : graph_(*node.graph), before_(graph_.draws()) { graph_.draws(node.draws); }
  ~DrawsOf() { graph_.draws(before_); }
  DrawsOf(const DrawsOf&) = delete;
  DrawsOf& operator=(const DrawsOf&) = delete;

 private:
  Graph& graph_;
  std::uint32_t before_;
};

/// What a user knows a value by.
std::string name_of(const Value& v) {
  if (const auto* input = dynamic_cast<const InputOp*>(v.node->op.get())) return input->input_name;
  if (const auto* state = dynamic_cast<const StateOp*>(v.node->op.get())) return state->state_name;
  return fmt::format("{} {}", v.node->op->name(), v.shape().text());
}

/// `at`: an input of the op that somebody wants, but to which no gradient comes.
[[noreturn]] void refuse(const Node& node, std::size_t at, std::span<const Value> wrt) {
  std::string wanted;
  for (const Value& v : wrt)
    if (wanted.empty() && Dependence(*node.graph, std::span(&v, 1))(node.inputs[at])) wanted = name_of(v);
  const bool never = dynamic_cast<const NotDifferentiable*>(node.op.get());
  throw Error(ErrorKind::Failed, fmt::format("no gradient reaches \"{}\"", wanted), "op " + node.op->name(),
              never ? "it is not differentiable" : fmt::format("its adjoint has none for input {}", at),
              "a detach() before it, or another op");
}

}  // namespace

Value accumulate(Value a, Value b) { return a.graph().make<AccumulateOp>({a, b}); }

Dependence::Dependence(const Graph& graph, std::span<const Value> wrt) {
  for (const Node& node : graph.nodes()) {
    std::vector<bool>& depends = depends_.emplace_back(node.outputs.size(), false);
    for (std::size_t o = 0; o < depends.size(); ++o)
      for (std::size_t i = 0; i < node.inputs.size() && !depends[o]; ++i)
        depends[o] =
            (*this)(node.inputs[i]) && node.op->slope(static_cast<int>(i), static_cast<int>(o)) != Slope::Detached;
    for (const Value& v : wrt)
      if (v.node == &node) depends[static_cast<std::size_t>(v.output)] = true;
  }
}

bool Dependence::operator()(const Value& v) const {
  return depends_[static_cast<std::size_t>(v.node->id)][static_cast<std::size_t>(v.output)];
}

std::vector<Value> gradient(std::span<const Value> outputs, std::span<const Value> seeds, std::span<const Value> wrt) {
  if (outputs.empty() || outputs.size() != seeds.size())
    throw Error(ErrorKind::Failed, "one seed per output is needed", "gradient");
  Graph& graph = outputs[0].graph();
  const int nodes = static_cast<int>(graph.nodes().size());
  const Dependence depends(graph, wrt);

  std::map<std::pair<int, int>, Arrivals> gradients;  // (node, output) -> gradient so far
  const auto add = [&](Value to, Value g, bool unread) {
    if (!(to.shape() == g.shape()))
      throw Error(ErrorKind::Failed, "a gradient has another shape than its value",
                  "adjoint into op " + to.node->op->name(), g.shape().text(), to.shape().text());
    gradients[{to.node->id, to.output}].add(g, unread);
  };
  for (std::size_t i = 0; i < outputs.size(); ++i)
    if (depends(outputs[i])) add(outputs[i], seeds[i], false);

  for (int id = nodes - 1; id >= 0; --id) {
    const Node& node = graph.nodes()[static_cast<std::size_t>(id)];
    std::vector<Value> arriving(node.outputs.size());
    std::vector<bool> wanted(node.inputs.size(), false);
    for (std::size_t o = 0; o < arriving.size(); ++o) {
      const auto found = gradients.find({id, static_cast<int>(o)});
      if (found == gradients.end()) continue;
      arriving[o] = found->second.total();
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        const Slope slope = node.op->slope(static_cast<int>(i), static_cast<int>(o));
        if (!depends(node.inputs[i]) || slope == Slope::Detached) continue;
        if (slope == Slope::None) refuse(node, i, wrt);
        wanted[i] = true;
      }
    }
    if (std::ranges::find(wanted, true) == wanted.end()) continue;
    const DrawsOf draws(node);
    const int first = static_cast<int>(graph.nodes().size());
    const std::vector<Value> leaving = node.op->adjoint_for(wanted, node, arriving);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (!wanted[i]) continue;
      if (i >= leaving.size() || !leaving[i]) refuse(node, i, wrt);
      add(node.inputs[i], leaving[i], is_unread(graph, leaving[i], leaving, first));
    }
  }

  std::vector<Value> result;
  for (const Value& v : wrt) {
    const auto found = gradients.find({v.node->id, v.output});
    result.push_back(found == gradients.end() ? Value{} : found->second.total());
  }
  return result;
}

std::vector<Value> gradient(Value loss, std::span<const Value> wrt) {
  if (loss.shape().count() != 1)
    throw Error(ErrorKind::Failed, "a loss is one number", "gradient", loss.shape().text(), "1x1x1x1");
  const Value one = loss.graph().fill({}, 1);
  return gradient(std::span(&loss, 1), std::span(&one, 1), wrt);
}

}  // namespace clerestory
