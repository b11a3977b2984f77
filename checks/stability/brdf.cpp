// Surfaces and their samplers: sample_brdf, value and gradient, and the model at directions that are given.
#include <cmath>
#include <random>

#include "checks/stability/stability_case.hpp"
#include "host/math/frames.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/shade/light_guide.hpp"

namespace clerestory {
namespace {

constexpr int kCount = 2048;  // surfaces of a case
constexpr int kRays = 16;     // of each
constexpr double kLeastCosine = 1e-4;

/// Surfaces by one number each.
using Spread = std::vector<double>;

Spread all(double value) { return Spread(kCount, value); }

struct Surface {
  Spread cosine, roughness, metallic;
  Spread length = all(1);  // of the normal
  double aside = 0;        // tangent of the largest angle between views and the axis, over the root of two
};

Vec3 at_pixel(const Tensor& map, int i) { return {map.at(i, 0, 0, 0), map.at(i, 1, 0, 0), map.at(i, 2, 0, 0)}; }

/// Towards the viewer of a picture of one pixel, of length one.
Vec3 view_of(const Tensor& camera, int i) {
  const double fx = camera.at(i, 0, 0, 0), fy = camera.at(i, 1, 0, 0);
  return glm::normalize(Vec3((camera.at(i, 2, 0, 0) - 0.5) / fx, (0.5 - camera.at(i, 3, 0, 0)) / fy, 1));
}

/// Pictures of one pixel each. Where the view runs along the axis a surface's cosine is its normal's z, to the last
/// bit.
Tensors maps_of(const Surface& s, std::uint64_t seed) {
  Tensors t{{"depth", Tensor(Shape{kCount, 1, 1, 1}, 2)},
            {"camera", Tensor(Shape{kCount, 4, 1, 1}, 1)},
            {"normal", Tensor(Shape{kCount, 3, 1, 1})},
            {"albedo", random_tensor({kCount, 3, 1, 1}, seed, 0.1, 0.9)},
            {"material", Tensor(Shape{kCount, 2, 1, 1})}};
  const Tensor turns = random_tensor({kCount, 1, 1, 1}, seed + 1, 0, 2 * M_PI);
  const Tensor places = random_tensor({kCount, 2, 1, 1}, seed + 2, -s.aside, s.aside);
  for (int i = 0; i < kCount; ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (int k = 0; k < 2; ++k) t["camera"].at(i, 2 + k, 0, 0) = 0.5 + places.at(i, k, 0, 0);
    const double c = s.cosine[at], across = std::sqrt(1 - c * c), turn = turns.real[at];
    const Vec3 local(across * std::cos(turn), across * std::sin(turn), c), view = view_of(t["camera"], i);
    const Vec3 normal = s.length[at] * (s.aside == 0 ? local : frame_around(view).from_local(local));
    for (int k = 0; k < 3; ++k) t["normal"].at(i, k, 0, 0) = normal[k];
    t["material"].at(i, 0, 0, 0) = s.roughness[at], t["material"].at(i, 1, 0, 0) = s.metallic[at];
  }
  return t;
}

/// By ray: whether the cosines of the direction and of the view are of the domain, by the twin's direction.
std::vector<char> rays_inside(const Tensors& maps, const Tensor& direction) {
  std::vector<char> inside;
  for (int p = 0; p < kCount; ++p) {
    const Vec3 n = glm::normalize(at_pixel(maps.at("normal"), p)), view = view_of(maps.at("camera"), p);
    for (int s = 0; s < kRays; ++s) {
      const Vec3 wi{direction.at(0, 0, p, s), direction.at(0, 1, p, s), direction.at(0, 2, p, s)};
      inside.push_back(glm::dot(n, view) >= kLeastCosine && glm::dot(n, wi) >= kLeastCosine);
    }
  }
  return inside;
}

/// What sample_brdf draws for the maps, by value and by the gradients of one ray each. Where there are "e_normal",
/// "e_albedo" and "e_material" these weigh it; where there are "lamps" some directions are drawn towards them.
StabilityCase drawn(const std::string& name, const Tensors& maps, const SamplingOptions& options = {}) {
  Formula f{.inputs = maps};
  const std::string prefix = maps.count("e_normal") ? "e_" : "";
  f.build = [=](Graph&, const Values& v) {
    const Surfaces sampling{v.at("albedo"), v.at("normal"), v.at("material")};
    const Surfaces weighing{v.at(prefix + "albedo"), v.at(prefix + "normal"), v.at(prefix + "material")};
    SamplingOptions with_lobes = options;
    with_lobes.lobes = true;
    const Value guide =
        v.count("lamps") ? light_guide(v.at("depth"), v.at("camera"), sampling, v.at("lamps"), kCount) : Value{};
    const BrdfSamples s =
        sample_brdf(v.at("depth"), v.at("camera"), sampling, weighing, kCount, kRays, with_lobes, guide);
    return std::vector<Compared>{
        {s.direction, false}, {s.weight}, {s.pdf, false}, {s.lobes.specular, false}, {s.lobes.density, false}};
  };
  f.differentiate = {prefix + "normal", prefix + "albedo", prefix + "material"};
  f.first_ray = true;
  StabilityCase c{.group = "brdf", .name = name};
  c.evaluate = [f](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    const std::vector<char> rays = rays_inside(f.inputs, found.values[0].tensor);
    std::vector<char> pixels;
    for (std::size_t i = 0; i < rays.size(); i += kRays) pixels.push_back(rays[i]);
    for (Evaluated& e : found.values) e.inside = rays;
    for (Evaluated& e : found.gradients) e.inside = pixels;
    return found;
  };
  return c;
}
StabilityCase drawn(const std::string& name, const Surface& surface) { return drawn(name, maps_of(surface, 5)); }

Spread inner_cosines() { return spread_logarithms(kCount, kLeastCosine, 1, 1); }
Spread outer_cosines() { return spread_logarithms(kCount, 1e-7, 0.99 * kLeastCosine, 1); }
Spread usual_roughness() { return spread_logarithms(kCount, 0.01, 1, 2); }
Spread some(double low, double high, std::uint64_t seed = 3) {
  return random_tensor({kCount, 1, 1, 1}, seed, low, high).real;
}

std::vector<StabilityCase> by_roughness() {
  std::vector<StabilityCase> cases;
  for (const double roughness : {0.0, 1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0}) {
    const std::string name = fmt::format("drawn, roughness {:g}", roughness);
    cases.push_back(drawn(name, {inner_cosines(), all(roughness), some(0, 1)}));
    cases.push_back(outside(drawn(name + ", grazing to 1e-7", {outer_cosines(), all(roughness), some(0, 1)})));
  }
  return cases;
}

/// Views aside of the axis: cosines are sums of three products.
std::vector<StabilityCase> aside() {
  std::vector<StabilityCase> cases;
  for (const double roughness : {0.01, 0.1, 1.0})
    cases.push_back(drawn(fmt::format("drawn aside of the axis, roughness {:g}", roughness),
                          {inner_cosines(), all(roughness), some(0, 1), all(1), 0.6}));
  cases.push_back(outside(drawn("drawn aside of the axis, grazing to 1e-7",
                                {outer_cosines(), usual_roughness(), some(0, 1), all(1), 0.6})));
  return cases;
}

std::vector<StabilityCase> by_sampler() {
  const Tensors maps = maps_of({inner_cosines(), usual_roughness(), some(0, 1)}, 5);
  std::vector<StabilityCase> cases;
  for (const char* name : {"vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform", "ndf_roughness"})
    cases.push_back(drawn(fmt::format("sampler {}", name), maps, {.sampler = sampler_of(name)}));
  cases.front().inside = false;  // a cross-check, not a way to render
  Tensors lit = maps;
  lit["lamps"] = Tensor({1, 5, 1, 2}, std::vector<double>{1.5, -4, 2, 0, 1, 3, 0.05, 1, 2000, 20});
  cases.push_back(drawn("guided, a small lamp and a large one", lit));
  return cases;
}

/// Weighed by other maps than those that draw, with normals up to `apart` from these, by component.
StabilityCase detached(const std::string& name, double roughness, double apart) {
  Tensors maps = maps_of({inner_cosines(), all(roughness), some(0, 1)}, 5);
  for (const char* map : {"normal", "albedo", "material"}) maps[std::string("e_") + map] = maps[map];
  const Tensor tilt = random_tensor(maps["normal"].shape, 9, -apart, apart);
  for (std::size_t i = 0; i < tilt.real.size(); ++i) maps["e_normal"].real[i] += tilt.real[i];
  return drawn(name, maps);
}

std::vector<StabilityCase> by_other_maps() {
  std::vector<StabilityCase> cases;
  for (const double roughness : {0.01, 0.03, 0.1, 0.3, 1.0}) {
    const double alpha = std::max(roughness * roughness, 1e-4);
    const std::string name = fmt::format("weighed by other maps, roughness {:g}", roughness);
    cases.push_back(detached(name, roughness, 0.25 * alpha));
    if (alpha < 0.1) cases.push_back(outside(detached(name + ", normals 0.2 apart", roughness, 0.2)));
  }
  return cases;
}

std::vector<StabilityCase> by_material() {
  std::vector<StabilityCase> cases;
  for (const double albedo : {0.0, 1.0})
    for (const double metallic : {0.0, 1.0}) {
      Tensors maps = maps_of({inner_cosines(), usual_roughness(), all(metallic)}, 5);
      maps["albedo"] = Tensor(maps["albedo"].shape, albedo);
      cases.push_back(drawn(fmt::format("albedo {:g}, metallic {:g}", albedo, metallic), maps));
    }
  return cases;
}

std::vector<StabilityCase> by_normal() {
  const auto of_length = [](double low, double high) {
    return maps_of({inner_cosines(), usual_roughness(), some(0, 1), spread_logarithms(kCount, low, high, 4)}, 5);
  };
  Tensors away = of_length(1, 1), none = away;
  for (int i = 0; i < kCount; ++i) away["normal"].at(i, 2, 0, 0) *= -1;
  none["normal"] = Tensor(none["normal"].shape, 0);
  return {drawn("normals of length 1e-3 to 1e3", of_length(1e-3, 1e3)),
          outside(drawn("normals of length 1e-30 to 1e30", of_length(1e-30, 1e30))),
          outside(drawn("normals that face away", away)), outside(drawn("normals of length 0", none))};
}

}  // namespace

std::vector<StabilityCase> brdf_stability() {
  std::vector<StabilityCase> cases;
  for (const auto make : {by_roughness, aside, by_sampler, by_other_maps, by_material, by_normal})
    for (StabilityCase& c : make()) cases.push_back(std::move(c));
  return cases;
}

}  // namespace clerestory
