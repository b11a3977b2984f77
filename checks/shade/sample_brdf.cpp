// The op that draws directions, against the surface model and the hash written again.
#include "host/ops/shade/sample_brdf.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/light_guide_reference.hpp"
#include "checks/shade/sample_brdf_reference.hpp"
#include "checks/shade/sobol_reference.hpp"
#include "checks/shade/surface_reference.hpp"
#include "host/math/frames.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

using namespace sample_brdf_reference;

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
    const bool deep = t.at("depth").real[static_cast<std::size_t>(p)] > 0;
    status.at(0, 0, p, 0) = !deep ? 1 : glm::dot(raw, view) > 0 ? 0 : 2;
    if (status.at(0, 0, p, 0) != 0) continue;
    const Frame frame = li_frame ? hemisphere_frame(glm::normalize(raw)) : frame_around(glm::normalize(raw));
    for (int s = 0; s < 16; ++s) {
      const Drawn d = draw(p, s);
      if (d.local.z <= 0) continue;
      const Vec3 wi = frame.from_local(d.local);
      const Weighed w = weigh(p, frame.to_local(view), d.local, view, wi);
      for (int c = 0; c < 3; ++c) {
        direction.at(0, c, p, s) = wi[c], weight.at(0, c, p, s) = w.f_cos[c] / d.pdf;
        specular.at(0, c, p, s) = w.share[c];
      }
      pdf.at(0, 0, p, s) = d.pdf, lobe.at(0, 0, p, s) = w.lobe;
    }
  }
  return {direction, weight, pdf, status, specular, lobe};
}

OpCase sample_case(const std::string& label, SamplingOptions options, bool detached) {
  options.lobes = true;
  OpCase c{.stem = "sample_brdf", .label = label, .kernels = {"sample_brdf"}, .inputs = maps(20)};
  if (detached)
    for (const auto& [name, tensor] : maps(40))
      if (name == "normal" || name == "albedo" || name == "material") c.inputs["e_" + name] = tensor;
  c.build = [=](Graph&, const Values& v) {
    const Surfaces sampling{v.at("albedo"), v.at("normal"), v.at("material")};
    const Surfaces evaluation = detached ? Surfaces{v.at("e_albedo"), v.at("e_normal"), v.at("e_material")} : sampling;
    const Value guide = v.count("guide") ? v.at("guide") : Value{};
    const BrdfSamples s = sample_brdf(v.at("depth"), v.at("camera"), sampling, evaluation, kRows, 16, options, guide);
    return std::vector<Value>{s.direction, s.weight, s.pdf, s.status, s.lobes.specular, s.lobes.density};
  };
  c.roundings = 100;  // directions through frames, a density, five factors of f and their squares
  c.no_gradient = "detached: see the cases of gradients";
  return c;
}

Drawn grid(int, int s) { return {hemisphere_direction(s / 16, s % 16), 1 / (128 * hemisphere_weight(s / 16))}; }

/// Directions drawn evenly over the hemisphere by points of `key`, worth what the evaluation maps say; with "guide"
/// some of them as its rows say.
std::vector<Tensor> uniform_reference(const Tensors& t, unsigned key, bool sobol) {
  const bool guided = t.count("guide") > 0;
  const auto draw = [&](int p, int s) {
    const auto pixel = static_cast<unsigned>(p), sample = static_cast<unsigned>(s);
    const Point4 bits = sobol ? scrambled_sobol_reference(key, pixel, sample, 0) : hashed_bits(key, pixel, sample, 0);
    const double u = unit_of(bits[0]), v = unit_of(bits[1]), r = std::sqrt(u * (2 - u));
    Drawn drawn{{r * std::cos(2 * M_PI * v), r * std::sin(2 * M_PI * v), 1 - u}, 0.5 / M_PI};
    if (!guided) return drawn;
    const Tensor& rows = t.at("guide");
    const Frame frame = frame_around(glm::normalize(pixel_of(t.at("normal"), p)));
    const double w = unit_of(bits[2]), chance = rows.at(p, 0, 0, 0);
    if (w < chance) drawn.local = frame.to_local(light_guide_reference::guided_direction(rows, p, u, v, w));
    drawn.pdf = (1 - chance) * drawn.pdf + light_guide_reference::guide_density(rows, p, frame.from_local(drawn.local));
    return drawn;
  };
  return reference(t, false, draw, [&](int p, const Vec3&, const Vec3&, const Vec3& view, const Vec3& towards) {
    const Frame e = frame_around(glm::normalize(pixel_of(t.at("e_normal"), p)));
    return weigh_ours(surface_of(t, "e_", p), e.to_local(view), e.to_local(towards));
  });
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

OP_CASES(sample_brdf) {
  OpCase ours = sample_case("grid", {.sampler = Sampler::Grid8x16}, false);
  ours.reference = [](const Tensors& t) {
    return reference(t, true, grid, [&](int p, const Vec3& wo, const Vec3& wi, const Vec3&, const Vec3&) {
      return weigh_ours(surface_of(t, "", p), wo, wi);
    });
  };
  OpCase theirs = sample_case("grid_li2020", {.sampler = Sampler::Grid8x16, .brdf = BrdfModel::Li2020}, false);
  theirs.reference = [](const Tensors& t) {
    return reference(t, true, grid, [&](int p, const Vec3& wo, const Vec3& wi, const Vec3&, const Vec3&) {
      return weigh_li2020(surface_of(t, "", p), wo, wi);
    });
  };
  const auto uniform = [](bool sobol) {
    OpCase c = sample_case(sobol ? "uniform_sobol" : "uniform_detached",
                           {.sampler = Sampler::Uniform, .points = sobol ? Points::Sobol : Points::Independent}, true);
    c.reference = [sobol, key = c.seed ^ 0x62726466u](const Tensors& t) { return uniform_reference(t, key, sobol); };
    return c;
  };
  const OpCase detached = uniform(false);
  OpCase guided = uniform(false);
  guided.label = "guided";
  guided.inputs["lamps"] = light_guide_reference::lamps();
  guided.inputs["guide"] = with_exact_axes(light_guide_reference::guide_rows(guided.inputs));
  guided.inputs.erase("lamps");
  OpCase gradients = guided;
  gradients.label = "gradients";
  gradients.kernels = {"sample_brdf", "sample_brdf_adjoint"};
  for (const char* name : {"normal", "albedo"}) gradients.inputs[std::string("e_") + name] = same_twice(0.4)[name];
  gradients.inputs["e_material"] = same_twice(0.4)["material"];
  gradients.build = [build = guided.build](Graph& g, const Values& v) {
    std::vector<Value> outputs = build(g, v);
    outputs[4] = multiply(outputs[1], outputs[4]);  // the specular part: the share alone is steep where both are little
    return outputs;
  };
  gradients.reference = [of_shares = guided.reference](const Tensors& t) {
    std::vector<Tensor> outputs = of_shares(t);
    for (std::size_t i = 0; i < outputs[4].real.size(); ++i) outputs[4].real[i] *= outputs[1].real[i];
    return outputs;
  };
  gradients.no_gradient = {};
  gradients.differentiate = {"e_normal", "e_albedo", "e_material"};
  gradients.gradient_tolerance = 1e-6;  // third slopes: 1e4 of the first where the lobe is narrow, times step^2
  return {ours, theirs, detached, uniform(true), guided, gradients};
}

}  // namespace
}  // namespace clerestory
