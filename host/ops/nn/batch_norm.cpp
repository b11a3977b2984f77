#include "host/ops/nn/batch_norm.hpp"

#include "host/graph/meeting.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/batch_norm.cl";

Shape per_channel(const Shape& x, int numbers) { return {1, x.c, 1, numbers}; }

void expect_shape(const Value& v, const Shape& expected, const char* what) {
  if (!(v.shape() == expected))
    throw Error(ErrorKind::Failed, std::string(what) + " has another shape", "batch_norm", v.shape().text(),
                expected.text());
}

Defines defines(const Launch& l, bool relu, bool adds = false) {
  Defines all{{"RELU", relu ? "1" : "0"}};
  if (adds) all["ADD"] = "1";
  return row_defines(l.device, all);
}

struct MomentsAdjointOp : NotDifferentiable, Adding {  // dmoments, x, moments (and a sum so far) -> dx
  bool adds;
  explicit MomentsAdjointOp(bool a = false) : adds(a) {}
  std::string name() const override { return "channel_moments_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override { return {{in[1].shape(), Type::Real}}; }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const int plane = static_cast<int>(s.plane());
    const Blocks blocks = row_blocks(l.device, plane);
    const auto run = [&](const auto&... sum) {
      l.run_with(defines(l, false, adds), kFile, "channel_moments_adjoint", row_range(l.device, blocks.count, s.c, s.n),
                 l.in(0), l.in(1), l.in(2), sum..., l.out(), s.n, plane, blocks.length);
    };
    adds ? run(l.in(3)) : run();
  }
  int overwrites() const override { return adds ? 3 : -1; }
  std::unique_ptr<const Op> adding() const override {
    return adds ? nullptr : std::make_unique<MomentsAdjointOp>(true);
  }
};

struct MomentsOp : Op {
  std::string name() const override { return "channel_moments"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{per_channel(in[0].shape(), 2), Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    return {g[0].graph().make<MomentsAdjointOp>({g[0], node.inputs[0], node.value()})};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run_with(row_defines(l.device), kFile, "channel_moments", row_range(l.device, s.c), l.in(0), l.out(), s.n,
               static_cast<int>(s.plane()));
  }
};

struct NormaliseAdjointOp : NotDifferentiable,
                            Adding {  // dy, x, moments, gamma, beta (and a sum so far) -> dx, dgamma, dbeta, dmoments
  bool relu;
  double epsilon;
  bool adds;
  NormaliseAdjointOp(bool r, double e, bool a = false) : relu(r), epsilon(e), adds(a) {}
  std::string name() const override { return "normalise_channels_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[1].shape();
    const Signature parameter{per_channel(s, 1), Type::Real};
    return {{s, Type::Real}, parameter, parameter, {per_channel(s, 2), Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const auto run = [&](const auto&... sum) {
      l.run_with(defines(l, relu, adds), kFile, "normalise_channels_adjoint", row_range(l.device, s.c), l.in(0),
                 l.in(1), l.in(2), l.in(3), l.in(4), sum..., l.out(0), l.out(1), l.out(2), l.out(3),
                 Launch::Real{epsilon}, s.n, static_cast<int>(s.plane()));
    };
    adds ? run(l.in(5)) : run();
  }
  int overwrites() const override { return 0; }
  std::unique_ptr<const Op> adding() const override {
    return adds ? nullptr : std::make_unique<NormaliseAdjointOp>(relu, epsilon, true);
  }
};

struct NormaliseOp : Op {  // x, moments, gamma, beta -> y
  bool relu;
  double epsilon;
  NormaliseOp(bool r, double e) : relu(r), epsilon(e) {}
  std::string name() const override { return "normalise_channels"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    expect_shape(in[1], per_channel(s, 2), "moments");
    expect_shape(in[2], per_channel(s, 1), "gamma");
    expect_shape(in[3], per_channel(s, 1), "beta");
    return {{s, Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> inputs{g[0]};
    inputs.insert(inputs.end(), node.inputs.begin(), node.inputs.end());
    const Value dx = g[0].graph().make<NormaliseAdjointOp>(inputs, relu, epsilon);
    return {dx, dx.node->value(3), dx.node->value(1), dx.node->value(2)};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.out().shape;
    const int plane = static_cast<int>(s.plane());
    const Blocks blocks = row_blocks(l.device, plane);
    l.run_with(defines(l, relu), kFile, "normalise_channels", row_range(l.device, blocks.count, s.c, s.n), l.in(0),
               l.in(1), l.in(2), l.in(3), l.out(), Launch::Real{epsilon}, plane, blocks.length);
  }
  int overwrites() const override { return 0; }
};

struct RunningMomentsOp : NotDifferentiable {
  std::string name() const override { return "running_moments"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    expect_shape(in[1], in[0].shape(), "running variance");
    return {{per_channel(in[0].shape(), 2), Type::Real}};
  }
  void launch(Launch& l) const override {
    const int channels = l.out().shape.c;
    l.run(kFile, "running_moments", Range::of(size(channels)), l.in(0), l.in(1), l.out(), channels);
  }
};

struct UpdateRunningOp : NotDifferentiable {  // moments, running mean, running variance
  double momentum;
  long count;
  UpdateRunningOp(double m, long c) : momentum(m), count(c) {}
  std::string name() const override { return "update_running"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    expect_shape(in[1], per_channel(in[0].shape(), 1), "running mean");
    expect_shape(in[2], per_channel(in[0].shape(), 1), "running variance");
    return {};
  }
  void launch(Launch& l) const override {
    const int channels = l.in(0).shape.c;
    const double unbias = static_cast<double>(count) / static_cast<double>(std::max(count - 1, 1L));
    l.run(kFile, "update_running", Range::of(size(channels)), l.in(0), l.in(1), l.in(2), Launch::Real{momentum},
          Launch::Real{unbias}, channels);
  }
  std::vector<int> writes() const override { return {1, 2}; }
};

}  // namespace

Value channel_moments(Value x) { return x.graph().make<MomentsOp>({x}); }

Value normalise_channels(Value x, Value moments, Value gamma, Value beta, bool relu, double epsilon) {
  return x.graph().make<NormaliseOp>({x, moments, gamma, beta}, relu, epsilon);
}

Value running_moments(Value running_mean, Value running_variance) {
  return running_mean.graph().make<RunningMomentsOp>({running_mean, running_variance});
}

void update_running(Value moments, Value running_mean, Value running_variance, long count, double momentum) {
  moments.graph().make<UpdateRunningOp>({moments, running_mean, running_variance}, momentum, count);
}

}  // namespace clerestory
