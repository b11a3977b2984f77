#include "host/ops/nn/conv.hpp"

#include <algorithm>
#include <array>

#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv_backend.hpp"
#include "host/ops/nn/conv_bias.hpp"

namespace clerestory {
namespace {

ConvShape conv_shape(const Shape& x, const Shape& w, const ConvSpec& spec) {
  return {x.c, x.h, x.w, w.n, w.h, w.w, spec.stride, spec.pad, static_cast<int>(w.item())};
}

Cost conv_cost(const ConvShape& s, int batch) {
  const double outputs = 1.0 * batch * s.outputs * s.out_height() * s.out_width();
  const double weights = 1.0 * s.outputs * s.channels * s.kernel_h * s.kernel_w;
  return {2 * outputs * s.channels * s.kernel_h * s.kernel_w,
          4 * (outputs + weights + 1.0 * batch * s.channels * s.height * s.width)};
}

[[noreturn]] void misfit(const std::string& what, const Shape& found, const std::string& expected) {
  throw Error(ErrorKind::Failed, what, "conv", found.text(), expected);
}

/// How the three inputs (moments, gamma, beta) from `first` on normalise x; nothing when there are none.
struct NormAttributes {
  bool present = false, relu = false;
  double epsilon = 0;

  std::optional<SourceNorm> views(const Launch& l, std::size_t first) const {
    if (!present) return std::nullopt;
    return SourceNorm{l.inputs[first], l.inputs[first + 1], l.inputs[first + 2], epsilon, relu};
  }
};

const SourceNorm* pointer(const std::optional<SourceNorm>& norm) { return norm ? &*norm : nullptr; }

/// dx from dy and w.
struct ConvDataOp : NotDifferentiable {
  ConvSpec spec;
  Shape x;
  ConvDataOp(ConvSpec s, Shape source) : spec(s), x(source) {}
  std::string name() const override { return "conv_data"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{x, Type::Real}}; }

  ConvShape shape(const Shape& w) const { return conv_shape(x, w, spec); }
  Cost cost(const Node& node) const override { return conv_cost(shape(node.in_shape(1)), x.n); }
  std::size_t workspace(const Node& node) const override {
    const ConvShape s = shape(node.in_shape(1));
    std::size_t packed = 0;
    for (const ConvPass& pass : backward_data_passes(s)) packed += packed_elements(pass.geometry);
    return std::max(packed, columns_elements(forward_pass(s).geometry, false, x.n));
  }

  void launch(Launch& l) const override {
    ConvShape s = shape(l.in(1).shape);
    s.weights_pitch = item_pitch(l.in(1));
    if (use_clblast(l, spec.kernels))
      return run_clblast_data(l, forward_pass(s).geometry, x.n, l.in(0), l.in(1), l.out());
    std::size_t at = 0;
    for (const ConvPass& pass : backward_data_passes(s)) {
      run_packed(l, pass, x.n, spec, l.in(0), nullptr, l.in(1), nullptr, l.out(), at);
      at += packed_elements(pass.geometry);
    }
  }
};

/// dw from x and dy (and moments, gamma, beta).
struct ConvWeightsOp : NotDifferentiable {
  ConvSpec spec;
  Shape w;
  NormAttributes norm;
  ConvWeightsOp(ConvSpec s, Shape weights, NormAttributes n) : spec(s), w(weights), norm(n) {}
  std::string name() const override { return "conv_weights"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{w, Type::Real}}; }

  ConvShape shape(const Shape& x) const { return conv_shape(x, w, spec); }
  Cost cost(const Node& node) const override { return conv_cost(shape(node.in_shape(0)), node.in_shape(0).n); }
  std::size_t workspace(const Node& node) const override {
    const ConvGeometry g = forward_pass(shape(node.in_shape(0))).geometry;
    return std::max(partial_elements(g, node.in_shape(0).n), columns_elements(g, norm.present, 1));
  }

  void launch(Launch& l) const override {
    const ConvGeometry g = forward_pass(shape(l.in(0).shape)).geometry;
    const int batch = l.in(0).shape.n;
    const std::optional<SourceNorm> source = norm.views(l, 2);
    if (use_clblast(l, spec.kernels))
      return run_clblast_weights(l, g, batch, l.in(0), pointer(source), l.in(1), l.out());
    run_packed_weights(l, g, batch, spec, l.in(0), pointer(source), l.in(1), nullptr, l.out(), item_pitch(l.out()));
  }
};

/// Inputs x, w, then the bias if there is one, then moments, gamma and beta if x is normalised.
struct ConvOp : Op {
  ConvSpec spec;
  bool has_bias;
  NormAttributes norm;
  ConvOp(ConvSpec s, bool b, NormAttributes n) : spec(s), has_bias(b), norm(n) {}
  std::string name() const override { return "conv"; }

  std::size_t first_of_norm() const { return has_bias ? 3 : 2; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &x = in[0].shape(), &w = in[1].shape();
    if (spec.stride < 1 || spec.pad < 0)
      throw Error(ErrorKind::Failed, "stride and padding", "conv", fmt::format("{} and {}", spec.stride, spec.pad),
                  "at least 1 and 0");
    if (w.c != x.c) misfit("weights of other channels than the input " + x.text(), w, fmt::format("?x{}x?x?", x.c));
    const ConvShape s = conv_shape(x, w, spec);
    if (s.height + 2 * s.pad < s.kernel_h || s.width + 2 * s.pad < s.kernel_w)
      misfit("a kernel larger than the padded input " + x.text(), w, "a smaller kernel or more padding");
    if (has_bias) expect("a bias of another shape", in[2].shape(), {1, w.n, 1, 1});
    if (norm.present) {
      const std::size_t first = first_of_norm();
      expect("moments of another shape", in[first].shape(), {1, x.c, 1, 2});
      expect("gamma of another shape", in[first + 1].shape(), {1, x.c, 1, 1});
      expect("beta of another shape", in[first + 2].shape(), {1, x.c, 1, 1});
    }
    return {{{x.n, w.n, s.out_height(), s.out_width()}, Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> dy) const override {
    Graph& graph = node.inputs[0].graph();
    const Value x = node.inputs[0], w = node.inputs[1];
    std::vector<Value> weights_inputs{x, dy[0]};
    for (std::size_t i = first_of_norm(); i < node.inputs.size(); ++i) weights_inputs.push_back(node.inputs[i]);
    std::vector<Value> gradients{graph.make<ConvDataOp>({dy[0], w}, spec, x.shape()),
                                 graph.make<ConvWeightsOp>(weights_inputs, spec, w.shape(), norm)};
    if (has_bias) gradients.push_back(conv_bias_gradient(dy[0]));
    if (norm.present) {
      // The gradient passes through a node that would normalise x; nobody needs its value, so it is pruned.
      const std::size_t first = first_of_norm();
      const Value z = normalise_channels(x, node.inputs[first], node.inputs[first + 1], node.inputs[first + 2],
                                         norm.relu, norm.epsilon);
      const std::vector<Value> through = z.node->op->adjoint(*z.node, std::array{gradients[0]});
      gradients[0] = through[0];
      gradients.insert(gradients.end(), through.begin() + 1, through.end());
    }
    return gradients;
  }

  ConvShape shape(const Node& node) const { return conv_shape(node.in_shape(0), node.in_shape(1), spec); }
  Cost cost(const Node& node) const override { return conv_cost(shape(node), node.in_shape(0).n); }
  std::size_t workspace(const Node& node) const override {
    const ConvGeometry g = forward_pass(shape(node)).geometry;
    return std::max(packed_elements(g), columns_elements(g, norm.present, node.in_shape(0).n));
  }

  void launch(Launch& l) const override {
    ConvShape s = conv_shape(l.in(0).shape, l.in(1).shape, spec);
    s.weights_pitch = item_pitch(l.in(1));
    const ConvPass pass = forward_pass(s);
    const TensorView* bias = has_bias ? &l.in(2) : nullptr;
    const std::optional<SourceNorm> source = norm.views(l, first_of_norm());
    const int batch = l.in(0).shape.n;
    if (use_clblast(l, spec.kernels))
      return run_clblast_forward(l, pass.geometry, batch, l.in(0), pointer(source), l.in(1), bias, l.out());
    run_packed(l, pass, batch, spec, l.in(0), pointer(source), l.in(1), bias, l.out());
  }

 private:
  static void expect(const std::string& what, const Shape& found, const Shape& expected) {
    if (!(found == expected)) misfit(what, found, expected.text());
  }
};

}  // namespace

Value conv(Value x, Value w, Value bias, const ConvSpec& spec) {
  std::vector<Value> inputs{x, w};
  if (bias) inputs.push_back(bias);
  return x.graph().make<ConvOp>(std::move(inputs), spec, static_cast<bool>(bias), NormAttributes{});
}

Value conv(Value x, const ConvNorm& norm, Value w, Value bias, const ConvSpec& spec) {
  std::vector<Value> inputs{x, w};
  if (bias) inputs.push_back(bias);
  inputs.insert(inputs.end(), {norm.moments, norm.gamma, norm.beta});
  return x.graph().make<ConvOp>(std::move(inputs), spec, static_cast<bool>(bias),
                                NormAttributes{true, norm.relu, norm.epsilon});
}

}  // namespace clerestory
