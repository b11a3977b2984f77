// Surfaces and their samplers: sample_brdf, value and gradient, and the model at directions that are given.
#include <cmath>
#include <random>

#include "checks/stability/stability_case.hpp"
#include "host/math/vec.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/shade/sample_brdf.hpp"

namespace clerestory {
namespace {

constexpr int kCount = 1024;  // surfaces of a case
constexpr int kRays = 16;     // of each
constexpr double kLeastCosine = 1e-4;

/// Surfaces by one number each.
using Spread = std::vector<double>;

Spread all(double value) { return Spread(kCount, value); }

struct Surface {
  Spread cosine, roughness, metallic;
  Spread length = all(1);  // of the normal
};

/// Pictures of one pixel each, whose view runs along the axis: a surface's cosine is its normal's z, to the last bit.
Tensors maps_of(const Surface& s, std::uint64_t seed) {
  Tensors t{{"depth", Tensor(Shape{kCount, 1, 1, 1}, 2)},
            {"camera", Tensor(Shape{kCount, 4, 1, 1})},
            {"normal", Tensor(Shape{kCount, 3, 1, 1})},
            {"albedo", random_tensor({kCount, 3, 1, 1}, seed, 0.1, 0.9)},
            {"material", Tensor(Shape{kCount, 2, 1, 1})}};
  const Tensor turns = random_tensor({kCount, 1, 1, 1}, seed + 1, 0, 2 * M_PI);
  for (int i = 0; i < kCount; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double c = s.cosine[at], across = std::sqrt(1 - c * c), turn = turns.real[at];
    const Vec3 normal = s.length[at] * Vec3(across * std::cos(turn), across * std::sin(turn), c);
    for (int k = 0; k < 3; ++k) t["normal"].at(i, k, 0, 0) = normal[k];
    t["camera"].at(i, 0, 0, 0) = t["camera"].at(i, 1, 0, 0) = 1;
    t["camera"].at(i, 2, 0, 0) = t["camera"].at(i, 3, 0, 0) = 0.5;
    t["material"].at(i, 0, 0, 0) = s.roughness[at], t["material"].at(i, 1, 0, 0) = s.metallic[at];
  }
  return t;
}

/// By ray: whether the cosines of the direction and of the view are of the domain, by the twin's direction.
std::vector<char> rays_inside(const Tensor& normal, const Tensor& direction) {
  std::vector<char> inside;
  for (int p = 0; p < kCount; ++p) {
    const Vec3 n = glm::normalize(Vec3(normal.at(p, 0, 0, 0), normal.at(p, 1, 0, 0), normal.at(p, 2, 0, 0)));
    for (int s = 0; s < kRays; ++s) {
      const Vec3 wi{direction.at(0, 0, p, s), direction.at(0, 1, p, s), direction.at(0, 2, p, s)};
      inside.push_back(n.z >= kLeastCosine && glm::dot(n, wi) >= kLeastCosine);
    }
  }
  return inside;
}

/// What sample_brdf draws for the surfaces, by value and by the gradients of one ray each. `other`: the maps that
/// weigh are not those that draw, though their numbers are the same.
StabilityCase drawn(const std::string& name, const Surface& surface, const SamplingOptions& options,
                    bool other = false) {
  Formula f{.inputs = maps_of(surface, 5)};
  const std::string prefix = other ? "e_" : "";
  if (other)
    for (const char* map : {"normal", "albedo", "material"}) f.inputs[prefix + map] = f.inputs[map];
  f.build = [=](Graph&, const Values& v) {
    const Surfaces sampling{v.at("albedo"), v.at("normal"), v.at("material")};
    const Surfaces weighing{v.at(prefix + "albedo"), v.at(prefix + "normal"), v.at(prefix + "material")};
    SamplingOptions with_lobes = options;
    with_lobes.lobes = true;
    const BrdfSamples s = sample_brdf(v.at("depth"), v.at("camera"), sampling, weighing, kCount, kRays, with_lobes);
    return std::vector<Compared>{
        {s.direction, false}, {s.weight}, {s.pdf, false}, {s.lobes.specular, false}, {s.lobes.density, false}};
  };
  f.differentiate = {prefix + "normal", prefix + "albedo", prefix + "material"};
  f.first_ray = true;
  StabilityCase c{.group = "brdf", .name = name};
  c.evaluate = [f, normal = f.inputs[prefix + "normal"]](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    const std::vector<char> rays = rays_inside(normal, found.values[0].tensor);
    std::vector<char> pixels;
    for (std::size_t i = 0; i < rays.size(); i += kRays) pixels.push_back(rays[i]);
    for (Evaluated& e : found.values) e.inside = rays;
    for (Evaluated& e : found.gradients) e.inside = pixels;
    return found;
  };
  return c;
}

Spread inner_cosines() { return spread_logarithms(kCount, kLeastCosine, 1, 1); }
Spread outer_cosines() { return spread_logarithms(kCount, 1e-7, 0.99 * kLeastCosine, 1); }
Spread some(double low, double high, std::uint64_t seed) {
  return random_tensor({kCount, 1, 1, 1}, seed, low, high).real;
}

}  // namespace

std::vector<StabilityCase> brdf_stability() {
  std::vector<StabilityCase> cases;
  for (const double roughness : {0.0, 1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0}) {
    const std::string name = fmt::format("drawn, roughness {:g}", roughness);
    cases.push_back(drawn(name, {inner_cosines(), all(roughness), some(0, 1, 3)}, {}));
    cases.push_back(drawn(name + ", grazing to 1e-7", {outer_cosines(), all(roughness), some(0, 1, 3)}, {}));
    cases.back().inside = false;
  }
  return cases;
}

}  // namespace clerestory
