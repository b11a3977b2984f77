#include "host/ops/shade/replay_sample.hpp"

#include "host/ops/light/rays.hpp"

namespace clerestory {
namespace {

constexpr int kNumbers = 21;

// Inputs: camera, normal, albedo, material, direction.
struct ReplaySampleOp : NotDifferentiable {
  Defines defines;
  explicit ReplaySampleOp(Defines d) : defines(std::move(d)) {}
  std::string name() const override { return "replay_sample"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[4], 3, "replay_sample");
    const Shape &normal = in[1].shape(), &rays = in[4].shape();
    if (normal.c != 3 || in[2].shape().plane() != normal.plane() || in[3].shape().plane() != normal.plane())
      throw Error(ErrorKind::Failed, "maps of unlike sizes", "replay_sample", in[2].shape().text(), normal.text());
    return {{{1, kNumbers, rays.h, rays.w}, Type::Real}};
  }

  void launch(Launch& l) const override {
    const Shape& s = l.in(1).shape;
    const RayTile t = ray_tile(l, l.out().shape, s.n * s.plane());
    l.run_with(defines, "shade/replay_sample.cl", "replay_sample", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3),
               l.in(4), l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity,
               t.sample_capacity, s.w, s.h, l.seed);
  }
};

}  // namespace

Value replay_sample(Value camera, const Surfaces& surfaces, Value direction, const SamplingOptions& options) {
  return direction.graph().make<ReplaySampleOp>(
      {camera, surfaces.normal, surfaces.albedo, surfaces.material, direction}, sampler_defines(options));
}

}  // namespace clerestory
