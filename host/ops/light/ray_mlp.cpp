#include "host/ops/light/ray_mlp.hpp"

#include <array>

#include "host/math/integers.hpp"
#include "host/ops/light/packed_layers.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/tensor/rows.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "light/ray_mlp.cl";
constexpr int kBlockRays = 48, kColumns = 16, kPanel = 8;  // of the kernels
constexpr int kMostGroupRays = 16;                         // a power of two that divides a block
constexpr int kFirst = 2;                                  // input that the weights begin at

/// Blocks of rays between the kernels, and what they hold.
struct RayBlocks {
  int count;
  explicit RayBlocks(const Shape& rays) : count(ceil_div(static_cast<int>(rays.plane()), kBlockRays)) {}
  /// Elements of n numbers of every ray.
  std::size_t of(int n) const { return size(count) * kBlockRays * size(round_up(n, kColumns)); }
  int rays() const { return count * kBlockRays; }
};

double products(const Node& node, const std::vector<MlpPart>& parts) {
  double count = 0;
  for (const MlpPart& p : parts) count += static_cast<double>(node.in_shape(p.weight).count());
  return count;
}

// Inputs: gradient of f, what was kept, the weights as of RayMlpOp. Outputs: the gradients of `input` and of the
// weights.
struct RayMlpAdjointOp : NotDifferentiable {
  int features, width, layers, again;
  RayMlpAdjointOp(int e, int w, int n, int a) : features(e), width(w), layers(n), again(a) {}
  std::string name() const override { return "ray_mlp_adjoint"; }

  std::vector<MlpPart> parts() const { return mlp_parts(kFirst, layers, again); }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& g = in[0].shape();
    std::vector<Signature> outputs{{{1, again > 0 ? 2 * width : width, g.h, g.w}, Type::Real}};
    for (const Value& weight : in.subspan(kFirst)) outputs.push_back({weight.shape(), Type::Real});
    return outputs;
  }

  /// Of the packed transposes of all but the first layer's weights.
  std::size_t packed() const { return packed_elements(3, width) + size(layers - 1) * packed_elements(width, width); }
  std::size_t workspace(const Node& node) const override {
    const RayBlocks blocks(node.in_shape(0));
    return packed() + size(layers) * blocks.of(width) + blocks.of(3);
  }

  void launch(Launch& l) const override {
    const RayBlocks blocks(l.in(0).shape);
    const std::vector<MlpPart> all = parts();
    std::size_t at = 0;
    for (auto p = all.rbegin(); p != all.rend(); ++p)
      if (!p->of_encoded) at = pack_transposed(l, l.in(p->weight), at);
    const TensorView slopes = l.workspace.from(at);
    const NetLaunch net = net_launch(l, blocks.rays(), width, 2 * activation_rows(width), kMostGroupRays);
    l.run_with(net.defines, kFile, "ray_mlp_slopes", net.range, l.in(0), l.workspace, l.in(1).from(blocks.of(features)),
               slopes, l.out(0), static_cast<int>(l.in(0).shape.plane()), width, layers, again, net.memory);
    for (const MlpPart& p : all) {
      const std::size_t before = p.of_encoded ? 0 : blocks.of(features) + size(p.layer - 1) * blocks.of(width);
      run_weights(l, p, slopes.from(size(p.layer) * blocks.of(width)), l.in(1).from(before), blocks.count);
    }
  }

  Cost cost(const Node& node) const override {
    const double rays = static_cast<double>(node.in_shape(0).plane());
    return {4 * rays * products(node, parts()), Op::cost(node).bytes};
  }

 private:
  // On a CPU two work-items share the columns and all of them the rows, so that what one walks stays in its second
  // cache; on a GPU each has one tile.
  void run_weights(Launch& l, const MlpPart& p, const TensorView& slopes, const TensorView& columns, int blocks) const {
    const TensorView& gradient = l.out(p.weight - 1);
    const int in = gradient.shape.c, out = gradient.shape.n, units = static_cast<int>(l.device.info().compute_units);
    const bool cpu = row_group(l.device) == 1;
    const int columns_each = cpu ? round_up(ceil_div(in, 2), kColumns) : 2;
    const int rows_each = cpu ? round_up(ceil_div(out, units), kPanel) : kPanel;
    l.run_with(net_defines(l.device), kFile, "ray_mlp_weights",
               Range::of2(size(ceil_div(in, columns_each)), size(ceil_div(out, rows_each)), cpu ? 1 : 16), slopes,
               columns, gradient, p.bias < 0 ? gradient : l.out(p.bias - 1), blocks, in, out,
               static_cast<int>(p.bias >= 0), columns_each, rows_each);
  }
};

// Inputs: input, encoded, then the weights by append_mlp().
struct RayMlpOp : Op {
  int layers, again;
  RayMlpOp(int n, int a) : layers(n), again(a) {}
  std::string name() const override { return "ray_mlp"; }

  std::vector<MlpPart> parts() const { return mlp_parts(kFirst, layers, again); }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &input = in[0].shape(), &encoded = in[1].shape();
    const int width = in[kFirst].shape().n;
    if (width > kMostMlpWidth || encoded.c > kMostMlpFeatures)
      throw Error(ErrorKind::Failed, "a net that this kernel does not have", "ray_mlp",
                  fmt::format("width {}, {} encoded numbers", width, encoded.c),
                  fmt::format("at most {} and {}", kMostMlpWidth, kMostMlpFeatures));
    const Shape want{1, again > 0 ? 2 * width : width, encoded.h, encoded.w};
    if (encoded.n != 1 || !(input == want))
      throw Error(ErrorKind::Failed, "the input does not fit the net and what is encoded", "ray_mlp", input.text(),
                  want.text());
    check_mlp(in, parts(), encoded.c, width, "ray_mlp");
    const RayBlocks blocks(encoded);
    const std::size_t kept = (blocks.of(encoded.c) + size(layers) * blocks.of(width)) / size(blocks.rays());
    return {{{1, 3, encoded.h, encoded.w}, Type::Real}, {{1, 1, blocks.rays(), static_cast<int>(kept)}, Type::Real}};
  }

  Slope slope(int, int output) const override { return output == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    Graph& graph = *node.graph;
    std::vector<Value> inputs{g[0], node.value(1)};
    inputs.insert(inputs.end(), node.inputs.begin() + kFirst, node.inputs.end());
    const Value d_input =
        graph.make<RayMlpAdjointOp>(std::move(inputs), node.in_shape(1).c, node.in_shape(kFirst).n, layers, again);
    std::vector<Value> gradients{d_input, encoded_gradient(node, d_input)};
    for (int i = kFirst; i < static_cast<int>(node.inputs.size()); ++i) gradients.push_back(d_input.node->value(i - 1));
    return gradients;
  }

  std::size_t workspace(const Node& node) const override {
    std::size_t count = 0;
    for (const MlpPart& p : parts()) count += packed_elements(node.in_shape(p.weight).c, node.in_shape(p.weight).n);
    return count;
  }

  void launch(Launch& l) const override {
    std::size_t at = 0;
    for (const MlpPart& p : parts()) at = pack_layer(l, l.in(p.weight), p.bias < 0 ? nullptr : &l.in(p.bias), at);
    const Shape& encoded = l.in(1).shape;
    const int width = l.in(kFirst).shape.n;
    const NetLaunch net =
        net_launch(l, RayBlocks(encoded).rays(), width, encoded.c + 2 * activation_rows(width), kMostGroupRays);
    l.run_with(net.defines, kFile, "ray_mlp", net.range, l.in(0), l.in(1), l.workspace, l.out(0), l.out(1),
               static_cast<int>(encoded.plane()), encoded.c, width, layers, again, net.memory);
  }

  Cost cost(const Node& node) const override {
    const double rays = static_cast<double>(node.in_shape(1).plane());
    return {2 * rays * products(node, parts()), Op::cost(node).bytes};
  }

 private:
  /// Through the convolutions that the net multiplies e by. Nobody needs their values, so they are pruned; all of it is
  /// where e is a constant.
  Value encoded_gradient(const Node& node, Value d_input) const {
    const int width = node.in_shape(kFirst).n;
    Value sum;
    for (const MlpPart& p : parts()) {
      if (!p.of_encoded) continue;
      const Value product = conv(node.inputs[1], node.inputs[static_cast<std::size_t>(p.weight)], {});
      const Value slope = again > 0 ? slice(d_input, p.layer == 0 ? 0 : width, width) : d_input;
      const Value g = product.node->op->adjoint(*product.node, std::array{slope})[0];
      sum = sum ? accumulate(sum, g) : g;
    }
    return sum;
  }
};

}  // namespace

Value ray_mlp(const LightMlp& mlp, Value input, Value encoded) {
  std::vector<Value> inputs{input, encoded};
  append_mlp(mlp, inputs, "ray_mlp");
  return input.graph().make<RayMlpOp>(std::move(inputs), static_cast<int>(mlp.biases.size()), mlp.again);
}

}  // namespace clerestory
