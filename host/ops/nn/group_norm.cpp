#include "host/ops/nn/group_norm.hpp"

#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/group_norm.cl";

Defines defines(const Launch& l, bool relu) { return row_defines(l.device, {{"RELU", relu ? "1" : "0"}}); }

struct GroupNormAdjointOp
    : NotDifferentiable {  // dy, x, gamma, beta, moments -> dx, dgamma, dbeta (both for each picture)
  bool relu;
  explicit GroupNormAdjointOp(bool r) : relu(r) {}
  std::string name() const override { return "group_norm_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[1].shape();
    const Signature parameter{{s.n, s.c, 1, 1}, Type::Real};
    return {{s, Type::Real}, parameter, parameter};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const int groups = l.in(4).shape.c;
    l.run_with(defines(l, relu), kFile, "group_normalise_adjoint", row_range(l.device, groups, s.n), l.in(0), l.in(1),
               l.in(2), l.in(3), l.in(4), l.out(0), l.out(1), l.out(2), s.c / groups, static_cast<int>(s.plane()));
  }
  int overwrites() const override { return 0; }
};

struct GroupNormOp : Op {  // x, gamma, beta -> y, moments
  int groups;
  bool relu;
  double epsilon;
  GroupNormOp(int g, bool r, double e) : groups(g), relu(r), epsilon(e) {}
  std::string name() const override { return "group_norm"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    const Shape parameter{1, s.c, 1, 1};
    if (groups < 1 || s.c % groups != 0)
      throw Error(ErrorKind::Failed, "channels do not divide into groups", "group_norm", s.text(),
                  fmt::format("a multiple of {}", groups));
    if (!(in[1].shape() == parameter) || !(in[2].shape() == parameter))
      throw Error(ErrorKind::Failed, "gamma or beta has another shape", "group_norm",
                  in[1].shape().text() + " and " + in[2].shape().text(), parameter.text());
    return {{s, Type::Real}, {{s.n, groups, 1, 2}, Type::Real}};
  }

  Slope slope(int, int output) const override { return output == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    const Value x = node.inputs[0], gamma = node.inputs[1];
    const Value dx = x.graph().make<GroupNormAdjointOp>({g[0], x, gamma, node.inputs[2], node.value(1)}, relu);
    return {dx, sum_to(dx.node->value(1), gamma.shape()), sum_to(dx.node->value(2), gamma.shape())};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    l.run_with(defines(l, relu), kFile, "group_normalise", row_range(l.device, groups, s.n), l.in(0), l.in(1), l.in(2),
               l.out(0), l.out(1), Launch::Real{epsilon}, s.c / groups, static_cast<int>(s.plane()));
  }
  int overwrites() const override { return 0; }
};

}  // namespace

Value group_norm(Value x, Value gamma, Value beta, int groups, bool relu, double epsilon) {
  return x.graph().make<GroupNormOp>({x, gamma, beta}, groups, relu, epsilon);
}

}  // namespace clerestory
