// Reverse mode: walks the nodes backwards and asks each for its adjoint, which are nodes of the same graph.
#include <algorithm>
#include <map>

#include "host/graph/graph.hpp"

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

/// Nodes from which a member of `wrt` can be reached backwards: only those need adjoints.
std::vector<bool> depends_on(const Graph& graph, std::span<const Value> wrt, int nodes) {
  std::vector<bool> depends(static_cast<std::size_t>(nodes), false);
  for (const Value& v : wrt) depends[static_cast<std::size_t>(v.node->id)] = true;
  for (int id = 0; id < nodes; ++id)
    for (const Value& v : graph.nodes()[static_cast<std::size_t>(id)].inputs)
      if (depends[static_cast<std::size_t>(v.node->id)]) depends[static_cast<std::size_t>(id)] = true;
  return depends;
}

}  // namespace

Value accumulate(Value a, Value b) { return a.graph().make<AccumulateOp>({a, b}); }

std::vector<Value> gradient(std::span<const Value> outputs, std::span<const Value> seeds, std::span<const Value> wrt) {
  if (outputs.empty() || outputs.size() != seeds.size())
    throw Error(ErrorKind::Failed, "one seed per output is needed", "gradient");
  Graph& graph = outputs[0].graph();
  const int nodes = static_cast<int>(graph.nodes().size());
  const std::vector<bool> depends = depends_on(graph, wrt, nodes);

  std::map<std::pair<int, int>, Value> gradients;  // (node, output) -> gradient so far
  const auto add = [&](Value to, Value g) {
    if (!(to.shape() == g.shape()))
      throw Error(ErrorKind::Failed, "a gradient has another shape than its value",
                  "adjoint into op " + to.node->op->name(), g.shape().text(), to.shape().text());
    Value& sum = gradients[{to.node->id, to.output}];
    sum = sum ? accumulate(sum, g) : g;
  };
  for (std::size_t i = 0; i < outputs.size(); ++i) add(outputs[i], seeds[i]);

  for (int id = nodes - 1; id >= 0; --id) {
    const Node& node = graph.nodes()[static_cast<std::size_t>(id)];
    if (!depends[static_cast<std::size_t>(id)] || node.inputs.empty()) continue;
    std::vector<Value> arriving(node.outputs.size());
    bool any = false;
    for (std::size_t o = 0; o < arriving.size(); ++o)
      if (auto found = gradients.find({id, static_cast<int>(o)}); found != gradients.end())
        arriving[o] = found->second, any = true;
    if (!any) continue;
    const std::vector<Value> leaving = node.op->adjoint(node, arriving);
    for (std::size_t i = 0; i < node.inputs.size() && i < leaving.size(); ++i)
      if (leaving[i] && depends[static_cast<std::size_t>(node.inputs[i].node->id)]) add(node.inputs[i], leaving[i]);
  }

  std::vector<Value> result;
  for (const Value& v : wrt) {
    const auto found = gradients.find({v.node->id, v.output});
    result.push_back(found == gradients.end() ? Value{} : found->second);
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
