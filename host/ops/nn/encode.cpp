#include "host/ops/nn/encode.hpp"

#include <cmath>

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/encode.cl";

// Inputs: x, frequencies, gradient.
struct EncodeAdjointOp : NotDifferentiable {
  std::string name() const override { return "encode_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[0].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run(kFile, "encode_adjoint", Range::of2(size(s.plane()), size(s.n)), l.in(0), l.in(1), l.in(2), l.out(), s.c,
          l.in(1).shape.n, static_cast<int>(s.plane()));
  }
};

struct EncodeOp : Op {
  std::string name() const override { return "encode"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape &x = in[0].shape(), &b = in[1].shape();
    if (b.c != x.c || b.plane() != 1)
      throw Error(ErrorKind::Failed, "frequencies do not fit what is encoded", "encode", b.text(),
                  fmt::format("m x {} x 1 x 1", x.c));
    return {{{x.n, 2 * b.n, x.h, x.w}, Type::Real}};
  }
  Slope slope(int input, int) const override { return input == 0 ? Slope::Adjoint : Slope::None; }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {node.graph->make<EncodeAdjointOp>({node.inputs[0], node.inputs[1], g[0]}), {}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const int features = l.in(1).shape.n;
    const Blocks blocks = row_blocks(l.device, s.plane());
    l.run_with(row_defines(l.device), kFile, "encode", row_range(l.device, blocks.count, features, s.n), l.in(0),
               l.in(1), l.out(), s.c, features, static_cast<int>(s.plane()), blocks.length);
  }
};

}  // namespace

Value encode(Value x, Value frequencies) { return x.graph().make<EncodeOp>({x, frequencies}); }

Tensor octave_frequencies(int channels, int octaves) {
  Tensor b(Shape{channels * octaves, channels, 1, 1});
  for (int c = 0; c < channels; ++c)
    for (int k = 0; k < octaves; ++k) b.at(c * octaves + k, c, 0, 0) = std::ldexp(0.5, k);
  return b;
}

}  // namespace clerestory
