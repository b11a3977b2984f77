#include "host/ops/shade/sum_samples.hpp"

#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

struct SumSamplesOp : NotDifferentiable {
  std::string name() const override { return "sum_samples"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& s = in[0].shape();
    check_rays(in[0], s.c, "sum_samples");
    return {{{1, s.c, s.h, 1}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(0).shape;
    const RayTile t = ray_tile(l, s);
    l.run_with(row_defines(l.device), "shade/sum_samples.cl", "sum_samples", row_range(l.device, s.h, s.c), l.in(0),
               l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity);
  }
};

}  // namespace

Value sum_samples(Value rays) { return rays.graph().make<SumSamplesOp>({rays}); }

}  // namespace clerestory
