// The op that draws directions, against the surface model and the hash written again.
#include "host/ops/shade/sample_brdf.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/light_guide_reference.hpp"
#include "checks/shade/sample_brdf_reference.hpp"
#include "checks/shade/sampler_reference.hpp"
#include "checks/shade/sobol_reference.hpp"
#include "host/math/frames.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

using namespace sample_brdf_reference;
using namespace sampler_reference;

struct Drawn {
  Vec3 local;
  double pdf;
};

Weighed weigh_ours(const SurfaceReference& s, const Vec3& wo, const Vec3& wi) {
  if (wo.z <= 0 || wi.z <= 0) return {Vec3(0), Vec3(0), 0};
  return {s.f_cos(wo, wi), s.specular_share(wo, wi), s.specular_pdf(0, wo, wi)};
}

/// What sample_brdf gives with lobes, from a rule that draws (pixel, sample) -> local direction in a frame of the
/// normal; below the surface: none.
template <class Draw, class Weigh>
std::vector<Tensor> reference(const Tensors& t, bool li_frame, Draw draw, Weigh weigh) {
  Tensor direction(Shape{1, 3, kRows, 16}), weight = direction, specular = direction, pdf(Shape{1, 1, kRows, 16}),
                                            lobe = pdf, status(Shape{1, 1, kRows, 1});
  for (int p = 0; p < kRows; ++p) {
    const Vec3 raw = pixel_of(t.at("normal"), p),
               view = -camera_in(t).direction(p % kWidth + 0.5, p % kPlane / kWidth + 0.5);
    const double z = t.at("depth").real[static_cast<std::size_t>(p)];
    const bool deep = z > 0 && std::isfinite(z);
    status.at(0, 0, p, 0) = !deep ? 1 : glm::dot(raw, view) > 0 ? 0 : 2;
    if (status.at(0, 0, p, 0) != 0) continue;
    const Frame frame = li_frame ? hemisphere_frame(glm::normalize(raw)) : frame_around(glm::normalize(raw));
    for (int s = 0; s < 16; ++s) {
      const Drawn d = draw(p, s);
      if (d.local.z <= 0) continue;
      const Vec3 wi = frame.from_local(d.local);
      const Weighed w = weigh(p, view, wi);
      for (int c = 0; c < 3; ++c) {
        direction.at(0, c, p, s) = wi[c], weight.at(0, c, p, s) = w.f_cos[c] / d.pdf;
        specular.at(0, c, p, s) = w.share[c];
      }
      pdf.at(0, 0, p, s) = d.pdf, lobe.at(0, 0, p, s) = w.lobe;
    }
  }
  return {direction, weight, pdf, status, specular, lobe};
}

/// Outputs of the op: with lobes six, else four.
std::vector<Value> outputs_of(const BrdfSamples& s) {
  std::vector<Value> outputs{s.direction, s.weight, s.pdf, s.status};
  if (s.lobes) outputs.insert(outputs.end(), {s.lobes.specular, s.lobes.density});
  return outputs;
}

Surfaces surfaces(const Values& v, const std::string& prefix = "") {
  return {v.at(prefix + "albedo"), v.at(prefix + "normal"), v.at(prefix + "material")};
}

BrdfSamples drawn_samples(const Values& v, const Surfaces& evaluation, const SamplingOptions& options) {
  return sample_brdf(v.at("depth"), v.at("camera"), surfaces(v), evaluation, kRows, 16, options,
                     v.count("guide") ? v.at("guide") : Value{});
}

/// Directions drawn by points of `key`, worth what the evaluation maps say; with "guide" some of them as its rows say.
std::vector<Tensor> drawn_reference(const Tensors& t, const SamplingOptions& options, unsigned key) {
  const bool guided = t.count("guide") > 0;
  const std::string prefix = t.count("e_normal") ? "e_" : "";
  const bool by_grid = options.sampler == Sampler::Grid8x16;
  const auto draw = [&](int p, int s) {
    if (by_grid) return Drawn{hemisphere_direction(s / 16, s % 16), 1 / (128 * hemisphere_weight(s / 16))};
    const auto pixel = static_cast<unsigned>(p), sample = static_cast<unsigned>(s);
    const Point4 bits = options.points == Points::Sobol ? scrambled_sobol_reference(key, pixel, sample, 0)
                                                        : hashed_bits(key, pixel, sample, 0);
    const double u = unit_of(bits[0]), v = unit_of(bits[1]), w = unit_of(bits[2]);
    const SurfaceReference surface = surface_of(t, "", p);
    const Frame frame = frame_around(glm::normalize(pixel_of(t.at("normal"), p)));
    const Vec3 wo = frame.to_local(-camera_in(t).direction(p % kWidth + 0.5, p % kPlane / kWidth + 0.5));
    const int sampler = static_cast<int>(options.sampler);
    const double p_lobe = surface.specular_probability(wo), aimed = guided ? t.at("guide").at(p, 0, 0, 0) : 0;
    const Vec3 local = w < aimed ? frame.to_local(light_guide_reference::guided_direction(t.at("guide"), p, u, v, w))
                                 : drawn(sampler, surface, wo, p_lobe, u, v, (w - aimed) / (1 - aimed));
    double pdf = (1 - aimed) * surface.pdf(sampler, wo, local, p_lobe);
    if (guided) pdf += light_guide_reference::guide_density(t.at("guide"), p, frame.from_local(local));
    return Drawn{local, pdf};
  };
  std::vector<Tensor> all = reference(t, by_grid, draw, [&](int p, const Vec3& view, const Vec3& towards) {
    const Frame e = frame_around(glm::normalize(pixel_of(t.at(prefix + "normal"), p)));
    const SurfaceReference surface = surface_of(t, prefix, p);
    const Vec3 wo = e.to_local(view), wi = e.to_local(towards);
    return options.brdf == BrdfModel::Li2020 ? weigh_li2020(surface, wo, wi) : weigh_ours(surface, wo, wi);
  });
  if (!options.lobes) all.resize(4);
  return all;
}

/// Every lobe along the coordinate axis that is next to its own: unit to the last digit when inputs are rounded to
/// float.
Tensor with_exact_axes(Tensor rows) {
  for (int p = 0; p < rows.shape.n; ++p)
    for (int k = 0; k < static_cast<int>(rows.at(p, 1, 0, 0)); ++k) {
      const Vec3 axis = light_guide_reference::axis_of(rows, p, k), size = glm::abs(axis);
      const int most = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      for (int c = 0; c < 3; ++c) rows.at(p, 2 + 6 * k + c, 0, 0) = c != most ? 0 : axis[c] < 0 ? -1 : 1;
    }
  return rows;
}

/// One build of the kernel.
struct Variant {
  SamplingOptions options;
  bool detached = false, guided = false;

  std::string label() const {
    static const char* const samplers[]{"caps",   "hemisphere", "bounded", "ndf",
                                        "cosine", "uniform",    "grid",    "ndf_roughness"};
    std::string text = samplers[static_cast<int>(options.sampler)];
    if (options.points == Points::Sobol && options.sampler != Sampler::Grid8x16) text += "_sobol";
    if (options.brdf == BrdfModel::Li2020) text += "_li2020";
    if (options.lobes) text += "_lobes";
    if (detached) text += "_detached";
    if (guided) text += "_guided";
    return text;
  }
};

OpCase samples_case(const Variant& variant) {
  OpCase c{.stem = "sample_brdf", .label = variant.label(), .kernels = {"sample_brdf"}, .inputs = maps(20)};
  if (variant.detached)
    for (const auto& [name, tensor] : maps(40))
      if (name == "normal" || name == "albedo" || name == "material") c.inputs["e_" + name] = tensor;
  if (variant.guided) {
    c.inputs["lamps"] = light_guide_reference::lamps();
    c.inputs["guide"] = with_exact_axes(light_guide_reference::guide_rows(c.inputs));
    c.inputs.erase("lamps");
  }
  c.build = [variant](Graph&, const Values& v) {
    return outputs_of(drawn_samples(v, surfaces(v, variant.detached ? "e_" : ""), variant.options));
  };
  c.reference = [options = variant.options, key = c.seed ^ 0x62726466u](const Tensors& t) {
    return drawn_reference(t, options, key);
  };
  c.roundings = 100;  // directions through frames, a density, five factors of f and their squares
  c.no_gradient = "see the cases of gradients";
  return c;
}

/// To evaluation maps of their own, against differences.
OpCase gradients_case(Variant variant) {
  variant.detached = true;
  OpCase c = samples_case(variant);
  c.label = "gradients_" + c.label;
  c.kernels = {"sample_brdf", "sample_brdf_adjoint"};
  for (const char* name : {"e_normal", "e_albedo", "e_material"}) c.inputs[name] = same_twice(0.4)[name];
  if (variant.options.lobes) {  // the specular part: the share alone is steep where both are little
    c.build = [build = c.build](Graph& g, const Values& v) {
      std::vector<Value> outputs = build(g, v);
      outputs[4] = multiply(outputs[1], outputs[4]);
      return outputs;
    };
    c.reference = [of_shares = c.reference](const Tensors& t) {
      std::vector<Tensor> outputs = of_shares(t);
      for (std::size_t i = 0; i < outputs[4].real.size(); ++i) outputs[4].real[i] *= outputs[1].real[i];
      return outputs;
    };
  }
  c.no_gradient = {};
  c.differentiate = {"e_normal", "e_albedo", "e_material"};
  c.gradient_tolerance = 1e-6;  // third slopes: 1e4 of the first where the lobe is narrow, times step^2
  return c;
}

/// To the maps that draw, which differences would move with what is drawn: as to equal ones that only evaluate.
OpCase gradients_of_drawing_case(const Variant& variant) {
  OpCase c = samples_case(variant);
  c.label = "gradients_of_drawing_" + c.label;
  c.kernels = {"sample_brdf", "sample_brdf_adjoint"};
  for (const char* name : {"normal", "albedo", "material"}) c.inputs[std::string("e_") + name] = c.inputs.at(name);
  c.inputs["d_weight"] = random_tensor({1, 3, kRows, 16}, 60);
  c.build = [variant](Graph&, const Values& v) {
    const auto gradients = [&](const Surfaces& evaluation) {
      const BrdfSamples s = drawn_samples(v, evaluation, variant.options);
      std::vector<Value> of{s.weight}, cotangents{v.at("d_weight")};
      if (s.lobes) of.push_back(multiply(s.weight, s.lobes.specular)), cotangents.push_back(v.at("d_weight"));
      return gradient(of, cotangents, std::vector{evaluation.normal, evaluation.albedo, evaluation.material});
    };
    std::vector<Value> own = gradients(surfaces(v)), others = gradients(surfaces(v, "e_")), apart;
    for (std::size_t i = 0; i < own.size(); ++i) apart.push_back(subtract(own[i], others[i]));
    return apart;
  };
  c.reference = [](const Tensors& t) {
    return std::vector<Tensor>{Tensor(t.at("normal").shape), Tensor(t.at("albedo").shape),
                               Tensor(t.at("material").shape)};
  };
  c.magnitude = 100;  // of a pixel's gradients: 16 samples, whose weights have slopes of ten
  c.no_gradient = "gradients are not differentiated again";
  return c;
}

constexpr std::array kSamplers{Sampler::VndfCaps, Sampler::VndfHemisphere, Sampler::VndfBounded, Sampler::Ndf,
                               Sampler::Cosine,   Sampler::Uniform,        Sampler::NdfRoughness};
constexpr Points kIndependent = Points::Independent, kSobol = Points::Sobol;

SamplingOptions drawing(Sampler sampler, Points points, bool lobes, BrdfModel brdf = BrdfModel::Ggx) {
  return {.sampler = sampler, .points = points, .brdf = brdf, .lobes = lobes};
}

/// The other builds that programs launch.
std::vector<OpCase> other_cases() {
  std::vector<OpCase> cases;
  for (const Sampler sampler : kSamplers)
    for (const Points points : {kIndependent, kSobol})
      for (const bool lobes : {false, true}) cases.push_back(samples_case({drawing(sampler, points, lobes)}));
  for (const BrdfModel brdf : {BrdfModel::Ggx, BrdfModel::Li2020})
    cases.push_back(samples_case({drawing(Sampler::Grid8x16, kIndependent, false, brdf)}));
  cases.push_back(samples_case({drawing(Sampler::VndfCaps, kIndependent, false, BrdfModel::Li2020)}));
  cases.push_back(samples_case({drawing(Sampler::VndfCaps, kSobol, true, BrdfModel::Li2020)}));
  for (const bool lobes : {false, true}) {
    for (const Points points : {kIndependent, kSobol}) {
      const SamplingOptions caps = drawing(Sampler::VndfCaps, points, lobes);
      cases.push_back(samples_case({caps, false, true}));
      cases.push_back(gradients_case({caps}));
    }
    cases.push_back(gradients_of_drawing_case({drawing(Sampler::VndfCaps, kSobol, lobes), false, true}));
    for (const Sampler sampler : kSamplers)
      cases.push_back(gradients_of_drawing_case({drawing(sampler, kSobol, lobes)}));
  }
  for (const Sampler sampler : kSamplers)
    if (sampler != Sampler::VndfCaps)
      cases.push_back(samples_case({drawing(sampler, kIndependent, false), false, true}));
  cases.push_back(gradients_case({drawing(Sampler::VndfCaps, kSobol, false), true, true}));
  cases.push_back(gradients_of_drawing_case({drawing(Sampler::VndfCaps, kIndependent, false)}));
  for (OpCase& c : cases) c.in_tests = false;
  return cases;
}

OP_CASES(sample_brdf) {
  const SamplingOptions grid = drawing(Sampler::Grid8x16, kIndependent, true),
                        uniform = drawing(Sampler::Uniform, kIndependent, true);
  std::vector<OpCase> cases{samples_case({grid}),
                            samples_case({drawing(Sampler::Grid8x16, kIndependent, true, BrdfModel::Li2020)}),
                            samples_case({uniform, true}),
                            samples_case({drawing(Sampler::Uniform, kSobol, true), true}),
                            samples_case({uniform, true, true}),
                            gradients_case({uniform, true, true})};
  std::ranges::move(other_cases(), std::back_inserter(cases));
  return cases;
}

}  // namespace
}  // namespace clerestory
