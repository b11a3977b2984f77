#include "host/ops/nn/gemm.hpp"

#include <algorithm>

#include "host/ops/nn/conv_backend.hpp"
#include "host/ops/nn/conv_bias.hpp"

namespace clerestory {
namespace {

enum class Kind { Plane, Channels };  // {1,1,rows,columns} or {rows,columns,1,1}

struct Matrix {
  int rows, columns;
  Kind kind;
};

Matrix matrix(const Shape& s) {
  if (s.h == 1 && s.w == 1) return {s.n, s.c, Kind::Channels};
  if (s.n == 1 && s.c == 1) return {s.h, s.w, Kind::Plane};
  throw Error(ErrorKind::Failed, "not a matrix", "matmul", s.text(), "{1,1,rows,columns} or {rows,columns,1,1}");
}

Shape shape_of(const Matrix& m) {
  return m.kind == Kind::Plane ? Shape{1, 1, m.rows, m.columns} : Shape{m.rows, m.columns, 1, 1};
}

// Elements between rows of a matrix in memory: rows that are batch items lie as far apart as the view says.
int row_pitch(const TensorView& t) {
  const Matrix m = matrix(t.shape);
  return m.kind == Kind::Channels ? item_pitch(t) : m.columns;
}

// {rows, depth} times {depth, columns}, all row-major but for A where it is transposed: columns are positions.
ConvPass product_pass(const Matrix& c, int depth, bool transpose_a, int a_pitch, int b_pitch, int c_pitch) {
  ConvGeometry g;
  g.channels = depth, g.outputs = c.rows;
  g.source_w = g.target_w = g.grid_w = c.columns;
  g.source_plane = b_pitch, g.target_plane = c_pitch;
  g.grid_h = 1;
  return {g, transpose_a ? ConvTaps{1, a_pitch} : ConvTaps{a_pitch, 1}};
}

// {rows, depth} times the transpose of {columns, depth}: rows of both are read along positions, as backward weights
// does.
ConvGeometry inner_product_pass(const Matrix& c, int depth, int a_pitch, int b_pitch) {
  ConvGeometry g;
  g.channels = c.columns, g.outputs = c.rows;
  g.source_w = g.target_w = g.grid_w = depth;
  g.source_plane = b_pitch, g.target_plane = a_pitch;
  g.grid_h = 1;
  return g;
}

/// op(A) op(B), and with a third input its columns' bias (then B is transposed).
struct MatmulOp : Op {
  MatmulSpec spec;
  Kind kind;
  MatmulOp(MatmulSpec s, Kind k) : spec(s), kind(k) {}
  std::string name() const override { return "gemm"; }

  struct Sizes {
    Matrix c;
    int depth, b_depth;
  };
  Sizes sizes(const Shape& a_shape, const Shape& b_shape) const {
    const Matrix a = matrix(a_shape), b = matrix(b_shape);
    return {{spec.transpose_a ? a.columns : a.rows, spec.transpose_b ? b.rows : b.columns, kind},
            spec.transpose_a ? a.rows : a.columns,
            spec.transpose_b ? b.columns : b.rows};
  }
  Sizes sizes(const Node& node) const { return sizes(node.in_shape(0), node.in_shape(1)); }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (spec.transpose_a && spec.transpose_b)
      throw Error(ErrorKind::Failed, "both factors transposed", "matmul", "", "the transpose of the other product");
    const Sizes s = sizes(in[0].shape(), in[1].shape());
    if (s.depth != s.b_depth)
      throw Error(ErrorKind::Failed, "matrices do not fit: " + in[0].shape().text() + " and " + in[1].shape().text(),
                  "matmul", fmt::format("inner sizes {} and {}", s.depth, s.b_depth), "equal ones");
    const Shape bias{1, s.c.columns, 1, 1};
    if (in.size() > 2 && !(in[2].shape() == bias))
      throw Error(ErrorKind::Failed, "a bias of another shape", "linear", in[2].shape().text(), bias.text());
    return {{shape_of(s.c), Type::Real}};
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> gradients) const override {
    Graph& graph = node.inputs[0].graph();
    const Value a = node.inputs[0], b = node.inputs[1], dc = gradients[0];
    const auto product = [&](Value left, bool transpose_left, Value right, bool transpose_right, Value like) {
      return graph.make<MatmulOp>({left, right}, MatmulSpec{transpose_left, transpose_right, spec.kernels},
                                  matrix(like.shape()).kind);
    };
    std::vector<Value> result{
        spec.transpose_a ? product(b, spec.transpose_b, dc, true, a) : product(dc, false, b, !spec.transpose_b, a),
        spec.transpose_b ? product(dc, true, a, spec.transpose_a, b) : product(a, !spec.transpose_a, dc, false, b)};
    if (node.inputs.size() > 2) result.push_back(conv_bias_gradient(dc));
    return result;
  }

  Cost cost(const Node& node) const override {
    const Sizes s = sizes(node);
    const double m = s.c.rows, n = s.c.columns, k = s.depth;
    return {2 * m * n * k, 4 * (m * k + k * n + m * n)};
  }

  std::size_t workspace(const Node& node) const override {
    const Sizes s = sizes(node);
    return spec.transpose_b
               ? partial_elements(inner_product_pass(s.c, s.depth, s.depth, s.depth), 1)
               : packed_elements(product_pass(s.c, s.depth, false, s.depth, s.c.columns, s.c.columns).geometry);
  }

  void launch(Launch& l) const override {
    const TensorView &a = l.in(0), &b = l.in(1), &c = l.out();
    const Sizes s = sizes(a.shape, b.shape);
    const TensorView* bias = l.inputs.size() > 2 ? &l.in(2) : nullptr;
    const int a_pitch = row_pitch(a), b_pitch = row_pitch(b), c_pitch = row_pitch(c);
    if (use_clblast(l, spec.kernels)) {
      if (bias) fill_columns(l, *bias, c, s.c.columns, c_pitch);
      clblast_gemm(l, s.c.rows, s.c.columns, s.depth, {a, 0, a_pitch, spec.transpose_a},
                   {b, 0, b_pitch, spec.transpose_b}, bias ? 1 : 0, {c, 0, c_pitch});
    } else if (spec.transpose_b) {
      run_packed_weights(l, inner_product_pass(s.c, s.depth, a_pitch, b_pitch), 1, {.kernels = spec.kernels}, b,
                         nullptr, a, bias, c, c_pitch);
    } else {
      run_packed(l, product_pass(s.c, s.depth, spec.transpose_a, a_pitch, b_pitch, c_pitch), 1,
                 {.kernels = spec.kernels}, b, nullptr, a, nullptr, c);
    }
  }

  // Every row of c = bias: the bias of "channels" that are columns, of one pixel each.
  static void fill_columns(Launch& l, const TensorView& bias, const TensorView& c, int columns, int pitch) {
    TensorView rows = c;
    rows.stride = pitch;
    const Range range{{1, static_cast<std::size_t>(columns), static_cast<std::size_t>(matrix(c.shape).rows)},
                      {64, 1, 1}};
    l.run("nn/conv_pack.cl", "conv_fill_bias", range, bias, rows, 1);
  }
};

}  // namespace

Value matmul(Value a, Value b, const MatmulSpec& spec) {
  return a.graph().make<MatmulOp>({a, b}, spec, matrix(a.shape()).kind);
}

Value linear(Value x, Value w, Value bias, ConvKernels kernels) {
  std::vector<Value> inputs{x, w};
  if (bias) inputs.push_back(bias);
  return x.graph().make<MatmulOp>(std::move(inputs), MatmulSpec{false, true, kernels}, Kind::Channels);
}

}  // namespace clerestory
