#include "host/ops/nn/map_loss.hpp"

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/map_loss.cl";
enum class Loss { Squared, Log, Cosine };

Defines defines(const Launch& l, Loss loss, bool scaled) {
  return row_defines(l.device, {{"LOSS", std::to_string(static_cast<int>(loss))}, {"SCALED", scaled ? "1" : "0"}});
}

void check_shapes(std::span<const Value> in) {
  const Shape& s = in[0].shape();
  const Shape mask{s.n, 1, s.h, s.w}, scale{s.n, 1, 1, 1};
  if (!(in[1].shape() == s))
    throw Error(ErrorKind::Failed, "the truth has another shape", "map_loss", in[1].shape().text(), s.text());
  if (!(in[2].shape() == mask))
    throw Error(ErrorKind::Failed, "the mask has another shape", "map_loss", in[2].shape().text(), mask.text());
  if (in.size() > 3 && !(in[3].shape() == scale))
    throw Error(ErrorKind::Failed, "the scale has another shape", "map_loss", in[3].shape().text(), scale.text());
}

struct MapLossAdjointOp : NotDifferentiable {  // dloss, share, prediction, truth, mask [, scale] -> dprediction
  Loss loss;
  explicit MapLossAdjointOp(Loss l) : loss(l) {}
  std::string name() const override { return "map_loss_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[2].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const int plane = static_cast<int>(s.plane());
    const Blocks blocks = row_blocks(l.device, plane);
    const bool scaled = l.inputs.size() > 5;
    l.run_with(defines(l, loss, scaled), kFile, "map_loss_adjoint", row_range(l.device, blocks.count, s.n), l.in(0),
               l.in(2), l.in(3), l.in(4), l.in(scaled ? 5 : 4), l.in(1), l.out(), s.c, plane, blocks.length);
  }
};

struct MapLossOp : Op {  // prediction, truth, mask [, scale] -> loss, share
  Loss loss;
  double factor;
  MapLossOp(Loss l, double f) : loss(l), factor(f) {}
  std::string name() const override { return "map_loss"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_shapes(in);
    return {{Shape{}, Type::Real}, {Shape{}, Type::Real}};
  }

  Slope slope(int input, int output) const override {
    if (input == 3) return Slope::Detached;  // the scale
    return input == 0 && output == 0 ? Slope::Adjoint : Slope::None;
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> inputs{g[0], node.value(1)};
    inputs.insert(inputs.end(), node.inputs.begin(), node.inputs.end());
    std::vector<Value> gradients(node.inputs.size());
    gradients[0] = g[0].graph().make<MapLossAdjointOp>(inputs, loss);
    return gradients;
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const int plane = static_cast<int>(s.plane());
    const Blocks blocks = row_blocks(l.device, plane);
    const bool scaled = l.inputs.size() > 3;
    l.run_with(defines(l, loss, scaled), kFile, "map_loss", row_range(l.device, blocks.count, s.n), l.in(0), l.in(1),
               l.in(2), l.in(scaled ? 3 : 2), l.workspace, s.c, plane, blocks.length);
    l.run_with(defines(l, loss, scaled), kFile, "map_loss_total", row_range(l.device, 1), l.workspace, l.out(0),
               l.out(1), Launch::Real{factor}, s.n * blocks.count);
  }

  std::size_t workspace(const Node& node) const override {
    const Shape& s = node.in_shape(0);  // two sums for each block, which are shortest on GPUs
    return size(2 * s.n * ((s.plane() + 1023) / 1024));
  }
};

struct ScaleOp : NotDifferentiable {
  std::string name() const override { return "least_squares_scale"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_shapes(in);
    return {{{in[0].shape().n, 1, 1, 1}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run_with(defines(l, Loss::Squared, false), kFile, "least_squares_scale", row_range(l.device, s.n), l.in(0),
               l.in(1), l.in(2), l.out(), s.c, static_cast<int>(s.plane()));
  }
};

}  // namespace

Value squared_loss(Value prediction, Value truth, Value mask, double factor) {
  return prediction.graph().make<MapLossOp>({prediction, truth, mask}, Loss::Squared, factor);
}

Value log_loss(Value prediction, Value truth, Value mask, double factor, Value scale) {
  std::vector<Value> inputs{prediction, truth, mask};
  if (scale) inputs.push_back(scale);
  return prediction.graph().make<MapLossOp>(inputs, Loss::Log, factor);
}

Value cosine_loss(Value prediction, Value truth, Value mask, double factor) {
  return prediction.graph().make<MapLossOp>({prediction, truth, mask}, Loss::Cosine, factor);
}

Value least_squares_scale(Value prediction, Value truth, Value mask) {
  return prediction.graph().make<ScaleOp>({prediction, truth, mask});
}

}  // namespace clerestory
