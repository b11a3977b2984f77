#include "host/ops/shade/sample_brdf.hpp"

#include <array>

#include "host/graph/map_chunks.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/shade/sum_samples.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr std::array kSamplers{"vndf_caps", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform", "grid8x16"};
constexpr int kGridDirections = 128;

constexpr auto kFile = "shade/sample_brdf.cl";

// Inputs: camera, normal, albedo, material of evaluation, direction, pdf, gradient of the weight.
struct SampleBrdfAdjointOp : NotDifferentiable {
  std::string name() const override { return "sample_brdf_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& rays = in[4].shape();
    return {{{1, 8, rays.h, rays.w}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& s = l.in(1).shape;
    const RayTile t = ray_tile(l, l.out().shape, s.n * s.plane());
    l.run(kFile, "sample_brdf_adjoint", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), l.in(5), l.in(6),
          l.out(), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity, s.w, s.h);
  }
};

// Inputs: depth, camera, normal, albedo, material of sampling, and those of evaluation when they differ.
struct SampleBrdfOp : Op {
  int pixels, samples;
  SamplingOptions options;
  bool detached;
  SampleBrdfOp(int p, int s, const SamplingOptions& o, bool d) : pixels(p), samples(s), options(o), detached(d) {}

  std::string name() const override { return "sample_brdf"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape d = in[0].shape();
    const auto expect = [&](const Value& v, int channels, const char* what) {
      const Shape s = v.shape();
      if (s.n != d.n || s.h != d.h || s.w != d.w || s.c < channels)
        throw Error(ErrorKind::Failed, fmt::format("{} does not fit the depth", what), "sample_brdf", s.text(),
                    Shape{d.n, channels, d.h, d.w}.text());
    };
    for (std::size_t k = 2; k + 2 < in.size(); k += 3)
      expect(in[k], 3, "the normal map"), expect(in[k + 1], 3, "the albedo"), expect(in[k + 2], 2, "the material");
    if (d.c != 1 || !(in[1].shape() == Shape{d.n, 4, 1, 1}))
      throw Error(ErrorKind::Failed, "a depth map and its camera are wanted", "sample_brdf",
                  d.text() + " and " + in[1].shape().text());
    if (samples % 16 != 0 || samples < 16 || pixels < 1)
      throw Error(ErrorKind::Failed, "samples come in sixteens", "sample_brdf",
                  fmt::format("{} x {}", pixels, samples));
    if (options.sampler == Sampler::Grid8x16 && samples > kGridDirections)
      throw usage_error("the grid has a fixed number of directions", "spp", std::to_string(samples), "128");
    return {{{1, 3, pixels, samples}, Type::Real},
            {{1, 3, pixels, samples}, Type::Real},
            {{1, 1, pixels, samples}, Type::Real},
            {{1, 1, pixels, 1}, Type::Real}};
  }

  int evaluation() const { return detached ? 5 : 2; }  // the first of the maps that the weight is a function of

  Slope slope(int input, int output) const override {
    if (input == 1) return Slope::None;
    if (options.brdf == BrdfModel::Li2020 && output == 1 && input >= evaluation()) return Slope::None;
    // Depth only says where a surface is; maps of sampling choose.
    return output == 1 && input >= evaluation() ? Slope::Adjoint : Slope::Detached;
  }

  /// Detached: through the weights alone, as f cos over a pdf that stays what it was.
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> result(node.inputs.size());
    const auto at = static_cast<std::size_t>(evaluation());
    const Value normal = node.inputs[at], albedo = node.inputs[at + 1], material = node.inputs[at + 2];
    const Value columns = sum_samples(node.graph->make<SampleBrdfAdjointOp>(
        {node.inputs[1], normal, albedo, material, node.value(0), node.value(2), g[1]}));
    const Shape two{material.shape().n, 2, material.shape().h, material.shape().w};
    const Value d_material = put_pixels(slice(columns, 6, 2), two);
    const Shape rest{two.n, material.shape().c - 2, two.h, two.w};
    result[at] = put_pixels(slice(columns, 0, 3), normal.shape());
    result[at + 1] = put_pixels(slice(columns, 3, 3), albedo.shape());
    result[at + 2] = rest.c == 0 ? d_material : concat(std::array{d_material, node.graph->fill(rest, 0)});
    return result;
  }

  void launch(Launch& l) const override {
    Defines defines{{"SAMPLER", std::to_string(static_cast<int>(options.sampler))}};
    if (options.points == Points::Sobol && options.sampler != Sampler::Grid8x16) defines["SOBOL"] = "1";
    if (options.brdf == BrdfModel::Li2020) defines["LI2020"] = "1";
    if (detached) {
      defines["DETACHED"] = "1";
      return draw(l, defines, l.in(5), l.in(6), l.in(7));
    }
    draw(l, defines);
  }

  template <class... Evaluation>
  void draw(Launch& l, const Defines& defines, const Evaluation&... evaluation) const {
    const Shape& s = l.in(0).shape;
    const RayTile t = ray_tile(l, l.out(0).shape, s.n * s.plane());
    l.run_with(defines, kFile, "sample_brdf", ray_range(t), l.in(0), l.in(1), l.in(2), l.in(3), l.in(4), evaluation...,
               l.out(0), l.out(1), l.out(2), l.out(3), t.first_pixel, t.pixels, t.first_sample, t.samples,
               t.pixel_capacity, t.sample_capacity, s.w, s.h, l.seed);
  }

  Cost cost(const Node& node) const override {
    const double rays = static_cast<double>(node.outputs[2].shape.count());
    return {rays * 250, rays * 7 * 4};
  }
};

}  // namespace

Sampler sampler_of(const std::string& name) {
  for (std::size_t i = 0; i < kSamplers.size(); ++i)
    if (name == kSamplers[i]) return static_cast<Sampler>(i);
  throw usage_error("no such sampler", "sampler", name,
                    "vndf_caps | vndf_hemisphere | vndf_bounded | ndf | cosine | uniform | grid8x16");
}

Points points_of(const std::string& name) {
  if (name == "independent") return Points::Independent;
  if (name == "sobol") return Points::Sobol;
  throw usage_error("no such points", "points", name, "independent | sobol");
}

BrdfModel brdf_model_of(const std::string& name) {
  if (name == "ggx") return BrdfModel::Ggx;
  if (name == "li2020") return BrdfModel::Li2020;
  throw usage_error("no such surface model", "brdf", name, "ggx | li2020");
}

BrdfSamples sample_brdf(Value depth, Value camera, const Surfaces& sampling, const Surfaces& evaluation, int pixels,
                        int samples, const SamplingOptions& options) {
  std::vector<Value> inputs{depth, camera, sampling.normal, sampling.albedo, sampling.material};
  const bool detached = !(evaluation.normal == sampling.normal && evaluation.albedo == sampling.albedo &&
                          evaluation.material == sampling.material);
  if (detached) inputs.insert(inputs.end(), {evaluation.normal, evaluation.albedo, evaluation.material});
  const Value first = depth.graph().make<SampleBrdfOp>(inputs, pixels, samples, options, detached);
  return {first, first.node->value(1), first.node->value(2), first.node->value(3)};
}

}  // namespace clerestory
