#include "host/ops/nn/depthwise.hpp"

#include <algorithm>

#include "host/math/integers.hpp"
#include "host/ops/nn/conv_bias.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/depthwise.cl";
constexpr int kPatch = 4096;  // PATCH of the kernels

/// Tiles of a plane that a group's local memory holds, as the kernels take them.
struct Tiling {
  int height = 0, width = 0, pitch = 0, across = 0, tiles = 0;

  /// `pictures` of every stride-th pixel lie in local memory, `halo` larger than the tile each; the widest tile is as
  /// wide as lets 15 rows of a picture fit beside it.
  Tiling(int out_height, int out_width, int halo, int pictures) {
    constexpr int lanes = 16, widest = 112;
    width = std::min(out_width, pictures > 1 ? widest / 2 : widest);
    pitch = round_up(width, lanes) + halo;
    height = std::min(out_height, kPatch / (pictures * pitch) - halo);
    across = ceil_div(out_width, width);
    tiles = across * ceil_div(out_height, height);
  }
};

Defines defines(const Launch& l, int kernel, int stride) {
  return row_defines(l.device, {{"K", std::to_string(kernel)}, {"STRIDE", std::to_string(stride)}});
}

/// The plane that is read, the kernel over it and the plane that comes out.
struct Geometry {
  int height, width, kernel, stride;
  int out_height = ceil_div(height, stride), out_width = ceil_div(width, stride);
  int pad_y = same_padding(height, kernel, stride), pad_x = same_padding(width, kernel, stride);
  int halo = (kernel - 1) / stride;

  Tiling tiles() const { return {out_height, out_width, halo, stride * stride}; }
};

Geometry geometry(const Shape& x, const Shape& w, int stride) { return {x.h, x.w, w.h, stride}; }

Cost depthwise_cost(const Shape& x, const Shape& w, int stride) {
  const Geometry g = geometry(x, w, stride);
  const double planes = 1.0 * x.n * x.c, outputs = planes * g.out_height * g.out_width;
  return {2 * outputs * g.kernel * g.kernel, 4 * (outputs + planes * g.height * g.width)};
}

struct DepthwiseDataOp : NotDifferentiable {  // dy, w -> dx
  int stride;
  Shape x;
  DepthwiseDataOp(int s, Shape source) : stride(s), x(source) {}
  std::string name() const override { return "depthwise_data"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{x, Type::Real}}; }
  Cost cost(const Node& node) const override { return depthwise_cost(x, node.in_shape(1), stride); }
  void launch(Launch& l) const override {
    const Geometry g = geometry(x, l.in(1).shape, stride);
    const int rows = ceil_div(g.height + g.pad_y % stride, stride),
              columns = ceil_div(g.width + g.pad_x % stride, stride);
    const Tiling t(rows, columns, g.halo, 1);
    l.run_with(defines(l, g.kernel, stride), kFile, "depthwise_data", row_range(l.device, x.c, x.n, t.tiles), l.in(0),
               l.in(1), l.out(), g.height, g.width, g.out_height, g.out_width, rows, columns, g.pad_y, g.pad_x,
               t.height, t.width, t.pitch, t.across);
  }
};

struct DepthwiseWeightsOp : NotDifferentiable {  // x, dy -> dw of each picture, {N,C,K,K}
  int stride;
  Shape w;
  DepthwiseWeightsOp(int s, Shape weights) : stride(s), w(weights) {}
  std::string name() const override { return "depthwise_weights"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{{in[0].shape().n, w.n, w.h, w.w}, Type::Real}};
  }
  Cost cost(const Node& node) const override { return depthwise_cost(node.in_shape(0), w, stride); }
  void launch(Launch& l) const override {
    const Shape& x = l.in(0).shape;
    const Geometry g = geometry(x, w, stride);
    const Tiling t = g.tiles();
    l.run_with(defines(l, g.kernel, stride), kFile, "depthwise_weights", row_range(l.device, x.c, x.n), l.in(0),
               l.in(1), l.out(), g.height, g.width, g.out_height, g.out_width, g.pad_y, g.pad_x, t.height, t.width,
               t.pitch, t.across, t.tiles);
  }
};

struct DepthwiseOp : Op {  // x, w, bias -> y
  int stride;
  explicit DepthwiseOp(int s) : stride(s) {}
  std::string name() const override { return "depthwise"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &x = in[0].shape(), &w = in[1].shape();
    const bool known = (w.h == 3 || w.h == 5) && w.w == w.h && (stride == 1 || stride == 2);
    if (!known)
      throw Error(ErrorKind::Failed, fmt::format("stride {}, weights {}", stride, w.text()), "depthwise", "",
                  "stride 1 or 2, a square kernel of 3 or 5");
    if (w.n != x.c || w.c != 1)
      throw Error(ErrorKind::Failed, "weights of other channels than the input " + x.text(), "depthwise", w.text(),
                  fmt::format("{}x1x{}x{}", x.c, w.h, w.w));
    const Shape bias{1, x.c, 1, 1};
    if (!(in[2].shape() == bias))
      throw Error(ErrorKind::Failed, "a bias of another shape", "depthwise", in[2].shape().text(), bias.text());
    return {{{x.n, x.c, ceil_div(x.h, stride), ceil_div(x.w, stride)}, Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> dy) const override {
    Graph& graph = node.inputs[0].graph();
    const Value x = node.inputs[0], w = node.inputs[1];
    const Shape& s = w.shape();
    const Value each = graph.make<DepthwiseWeightsOp>({x, dy[0]}, stride, s);
    return {graph.make<DepthwiseDataOp>({dy[0], w}, stride, x.shape()), reshape(sum_to(each, {1, s.n, s.h, s.w}), s),
            conv_bias_gradient(dy[0])};
  }

  Cost cost(const Node& node) const override { return depthwise_cost(node.in_shape(0), node.in_shape(1), stride); }
  void launch(Launch& l) const override {
    const Shape& x = l.in(0).shape;
    const Geometry g = geometry(x, l.in(1).shape, stride);
    const Tiling t = g.tiles();
    l.run_with(defines(l, g.kernel, stride), kFile, "depthwise", row_range(l.device, x.c, x.n, t.tiles), l.in(0),
               l.in(1), l.in(2), l.out(), g.height, g.width, g.out_height, g.out_width, g.pad_y, g.pad_x, t.height,
               t.width, t.pitch, t.across);
  }
};

}  // namespace

int same_padding(int size, int kernel, int stride) {
  return std::max((ceil_div(size, stride) - 1) * stride + kernel - size, 0) / 2;
}

Value depthwise(Value x, Value w, Value bias, int stride) { return x.graph().make<DepthwiseOp>({x, w, bias}, stride); }

}  // namespace clerestory
