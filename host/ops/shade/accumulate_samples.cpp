#include "host/ops/shade/accumulate_samples.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "shade/accumulate_samples.cl";

struct AccumulateSamplesAdjointOp : NotDifferentiable {
  int count;
  explicit AccumulateSamplesAdjointOp(int c) : count(c) {}
  std::string name() const override { return "accumulate_samples_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{in[0].shape(), Type::Real}, {in[1].shape(), Type::Real}};
  }
  void launch(Launch& l) const override {
    const RayTile t = ray_tile(l, l.out().shape);
    l.run_with(row_defines(l.device), kFile, "accumulate_samples_adjoint", ray_range(t), l.in(0), l.in(1), l.in(2),
               l.in(3), l.out(0), l.out(1), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity,
               t.sample_capacity, Launch::Real{static_cast<double>(count)});
  }
};

// Inputs: weight, radiance, pdf, [u, hit].
struct AccumulateSamplesOp : Op {
  int count;
  explicit AccumulateSamplesOp(int c) : count(c) {}
  std::string name() const override { return "accumulate_samples"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[0], 3, "accumulate_samples");
    const Shape s = in[0].shape();
    for (std::size_t k = 1; k < in.size(); ++k) {
      const Shape wanted{1, k == 1 ? 3 : 1, s.h, s.w};
      if (!(in[k].shape() == wanted))
        throw Error(ErrorKind::Failed, "tensors of unlike rays", "accumulate_samples", in[k].shape().text(),
                    wanted.text());
    }
    return {{{1, 3, s.h, 1}, Type::Real},
            {{1, 3, s.h, 1}, Type::Real},
            {{1, 4, s.h, 1}, Type::Real},
            {{1, 1, s.h, 1}, Type::Real}};
  }

  Slope slope(int input, int output) const override {
    if (output > 0) return Slope::None;
    return input < 2 ? Slope::Adjoint
                     : Slope::Detached;  // a pdf of 0 says that there is no sample; the rest is tallied
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> result(node.inputs.size());
    const Value first =
        node.graph->make<AccumulateSamplesAdjointOp>({node.inputs[0], node.inputs[1], node.inputs[2], g[0]}, count);
    result[0] = first, result[1] = first.node->value(1);
    return result;
  }

  void launch(Launch& l) const override {
    Defines defines = row_defines(l.device);
    if (l.inputs.size() == 3) return sum(l, defines);
    defines["TRACED"] = "1";
    sum(l, defines, l.in(3), l.in(4));
  }

  template <class... More>
  void sum(Launch& l, const Defines& defines, const More&... more) const {
    const RayTile t = ray_tile(l, l.in(0).shape);
    l.run_with(defines, kFile, "accumulate_samples", row_range(l.device, t.pixels), l.in(0), l.in(1), l.in(2), more...,
               l.out(0), l.out(1), l.out(2), l.out(3), t.first_pixel, t.pixels, t.first_sample, t.samples,
               t.pixel_capacity, t.sample_capacity, Launch::Real{static_cast<double>(count)});
  }
};

struct FinishSamplesOp : NotDifferentiable {
  int count, chunks;
  FinishSamplesOp(int c, int k) : count(c), chunks(k) {}
  std::string name() const override { return "finish_samples"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape s = in[0].shape();
    if (s.c != 3 || !(in[1].shape() == Shape{s.n, 4, s.h, s.w}))
      throw Error(ErrorKind::Failed, "squares and tally do not fit", "finish_samples",
                  s.text() + " and " + in[1].shape().text());
    if (count <= chunks)
      throw usage_error("a standard error needs more samples", "spp", std::to_string(count), "at least 2");
    return {{s, Type::Real}, {{s.n, 1, s.h, s.w}, Type::Real}};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    l.run(kFile, "finish_samples", Range::of2(size(s.plane()), size(s.n)), l.in(0), l.in(1), l.out(0), l.out(1),
          static_cast<int>(s.plane()), Launch::Real{static_cast<double>(count)},
          Launch::Real{static_cast<double>(count - chunks)});
  }
};

}  // namespace

SampleSums accumulate_samples(Value weight, Value radiance, Value pdf, Value u, Value hit_pixel, int count) {
  std::vector<Value> inputs{weight, radiance, pdf};
  if (u) inputs.insert(inputs.end(), {u, hit_pixel});
  const Value first = weight.graph().make<AccumulateSamplesOp>(inputs, count);
  return {first, first.node->value(1), first.node->value(2), first.node->value(3)};
}

SampleStatistics finish_samples(Value squares, Value tally, int count, int chunks) {
  const Value first = squares.graph().make<FinishSamplesOp>({squares, tally}, count, chunks);
  return {first, first.node->value(1)};
}

}  // namespace clerestory
