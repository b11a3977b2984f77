#include "host/ops/shade/sample_brdf.hpp"

#include <array>

#include "host/graph/map_chunks.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/rows.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr std::array kSamplers{"vndf_caps", "vndf_hemisphere", "vndf_bounded", "ndf",
                               "cosine",    "uniform",         "grid8x16",     "ndf_roughness"};
constexpr int kGridDirections = 128;

constexpr auto kFile = "shade/sample_brdf.cl";

/// What both kernels are built with, and how many inputs are maps: depth, camera, normal, albedo, material of sampling,
/// and those of evaluation when they differ. The guide, if there is one, comes behind them.
struct Drawing {
  SamplingOptions options;
  bool detached, guided;

  std::size_t maps() const { return detached ? 8 : 5; }
  std::size_t inputs() const { return maps() + guided; }
  Defines defines() const {
    Defines defines = sampler_defines(options);
    if (options.brdf == BrdfModel::Li2020) defines["LI2020"] = "1";
    if (options.lobes) defines["LOBES"] = "1";
    if (detached) defines["DETACHED"] = "1";
    if (guided) defines["GUIDED"] = "1";
    return defines;
  }
  RayTile tile(const Launch& l, const Shape& rays) const {
    const Shape& s = l.in(0).shape;
    return ray_tile(l, rays, s.n * s.plane());
  }
  /// Runs `kernel` with its inputs and outputs, the tile and the seed.
  void run(Launch& l, const char* kernel, const Range& range, const RayTile& t) const {
    const Shape& s = l.in(0).shape;
    std::vector<TensorView> tensors = l.inputs;
    tensors.insert(tensors.end(), l.outputs.begin(), l.outputs.end());
    l.run_with(row_defines(l.device, defines()), kFile, kernel, range, tensors, t.first_pixel, t.pixels, t.first_sample,
               t.samples, t.pixel_capacity, t.sample_capacity, s.w, s.h, l.seed);
  }
};

// Inputs: maps, the guide, gradients of the weight and, with lobes, of its specular share and their density. Output:
// what the rays of each pixel give to its surface together, a column.
struct SampleBrdfAdjointOp : NotDifferentiable {
  Drawing drawing;
  explicit SampleBrdfAdjointOp(const Drawing& d) : drawing(d) {}
  std::string name() const override { return "sample_brdf_adjoint"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{{1, 8, in[drawing.inputs()].shape().h, 1}, Type::Real}};
  }
  void launch(Launch& l) const override {
    const Shape& rays = l.in(static_cast<int>(drawing.inputs())).shape;
    drawing.run(l, "sample_brdf_adjoint", row_range(l.device, rays.h), drawing.tile(l, rays));
  }
};

// Inputs: maps, the guide. Outputs: direction, weight, pdf, status and, with lobes, their specular share and density.
struct SampleBrdfOp : Op {
  int pixels, samples;
  Drawing drawing;
  SampleBrdfOp(int p, int s, const Drawing& d) : pixels(p), samples(s), drawing(d) {}

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
    if (drawing.guided) check_guide(in.back());
    if (drawing.options.sampler == Sampler::Grid8x16 && samples > kGridDirections)
      throw usage_error("the grid has a fixed number of directions", "spp", std::to_string(samples), "128");
    const Signature one{{1, 1, pixels, samples}}, three{{1, 3, pixels, samples}};
    std::vector<Signature> outputs{three, three, one, {{1, 1, pixels, 1}}};
    if (drawing.options.lobes) outputs.insert(outputs.end(), {three, one});
    return outputs;
  }

  Slope slope(int input, int output) const override {
    const int evaluation = static_cast<int>(drawing.maps()) - 3;  // the first of the maps that weights are functions of
    const bool weighs = (output == 1 || output >= 4) && input >= evaluation && input < evaluation + 3;
    if (input == 1 || (weighs && drawing.options.brdf == BrdfModel::Li2020)) return Slope::None;
    // Depth only says where a surface is; maps of sampling and the guide choose.
    return weighs ? Slope::Adjoint : Slope::Detached;
  }

  /// Detached: through the weights and lobes alone, as f cos over a pdf that stays what it was.
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override {
    std::vector<Value> result(node.inputs.size());
    const bool lobes = drawing.options.lobes;
    const auto given = [&](int k) {
      const auto at = static_cast<std::size_t>(k);
      return g[at] ? g[at] : node.graph->fill(node.outputs[at].shape, 0);
    };
    std::vector<Value> in = node.inputs;
    in.push_back(given(1));
    if (lobes) in.insert(in.end(), {given(4), given(5)});
    const Value columns = node.graph->make<SampleBrdfAdjointOp>(in, drawing);
    const std::size_t at = drawing.maps() - 3;
    const Value normal = node.inputs[at], albedo = node.inputs[at + 1], material = node.inputs[at + 2];
    const Shape rest{1, material.shape().c - 2, pixels, 1};
    const Value used = slice(columns, 6, 2);
    result[at] = put_pixels(slice(columns, 0, 3), normal.shape());
    result[at + 1] = put_pixels(slice(columns, 3, 3), albedo.shape());
    result[at + 2] =
        put_pixels(rest.c == 0 ? used : concat(std::array{used, node.graph->fill(rest, 0)}), material.shape());
    return result;
  }

  /// On CPUs a work-item takes all samples of its pixel.
  void launch(Launch& l) const override {
    const RayTile t = drawing.tile(l, l.out().shape);
    const bool rows = row_group(l.device) == 1;
    drawing.run(l, "sample_brdf", rows ? Range::of2(1, size(t.pixels), 1) : ray_range(t), t);
  }

  void check_guide(const Value& guide) const {
    const Shape& rows = guide.shape();
    if (rows.n != pixels || rows.c <= kGuideHead || (rows.c - kGuideHead) % kGuideLobe != 0 || rows.plane() != 1)
      throw Error(ErrorKind::Failed, "not a guide for these pixels", "sample_brdf", rows.text(),
                  fmt::format("{}x({} + {} k)x1x1", pixels, kGuideHead, kGuideLobe));
    if (drawing.options.sampler == Sampler::Grid8x16)
      throw Error(ErrorKind::Failed, "the directions of the grid are fixed: no guide joins them", "sample_brdf");
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
  throw usage_error("no such sampler", "sampler", name, fmt::format("{}", fmt::join(kSamplers, " | ")));
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

Defines sampler_defines(const SamplingOptions& options) {
  Defines defines{{"SAMPLER", std::to_string(static_cast<int>(options.sampler))}};
  if (options.points == Points::Sobol && options.sampler != Sampler::Grid8x16) defines["SOBOL"] = "1";
  return defines;
}

BrdfSamples sample_brdf(Value depth, Value camera, const Surfaces& sampling, const Surfaces& evaluation, int pixels,
                        int samples, const SamplingOptions& options, Value guide) {
  std::vector<Value> inputs{depth, camera, sampling.normal, sampling.albedo, sampling.material};
  const bool detached = !(evaluation.normal == sampling.normal && evaluation.albedo == sampling.albedo &&
                          evaluation.material == sampling.material);
  if (detached) inputs.insert(inputs.end(), {evaluation.normal, evaluation.albedo, evaluation.material});
  if (guide) inputs.push_back(guide);
  const Drawing drawing{options, detached, static_cast<bool>(guide)};
  const Value first = depth.graph().make<SampleBrdfOp>(inputs, pixels, samples, drawing);
  const auto output = [&](int k) { return first.node->value(k); };
  return {first, output(1), output(2), output(3), options.lobes ? Lobes{output(4), output(5)} : Lobes{}};
}

}  // namespace clerestory
