// The field out of view: volume rendering of segments thin and thick, and where it is looked at; and the rival's light,
// spherical Gaussians of all sharpness.
#include <cmath>

#include "checks/light/unit_tensors.hpp"
#include "checks/stability/stability_case.hpp"
#include "host/ops/light/ask_shells.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/light/march.hpp"
#include "host/ops/light/spherical_gaussians.hpp"
#include "host/ops/nn/activation.hpp"

namespace clerestory {
namespace {

constexpr int kSegments = 16, kPixels = 64, kSamples = 16;
constexpr double kStep = 0.125;  // exact, so that thickness is as the case says

/// Segments whose density times step is from `low` to `high`.
StabilityCase composited(const std::string& name, double low, double high) {
  const Shape number{kSegments, 1, kPixels, kSamples}, colour{kSegments, 3, kPixels, kSamples};
  const int count = static_cast<int>(number.count());
  const Tensor density =
      high > 0 ? Tensor(number, spread_logarithms(count, low / kStep, high / kStep, 2)) : Tensor(number, 0);
  Formula f{.inputs = {
                {"density", density}, {"colour", random_tensor(colour, 1, 0.1, 2)}, {"length", Tensor(number, kStep)}}};
  f.build = [](Graph&, const Values& v) {
    const Composited c = composite(v.at("density"), v.at("colour"), v.at("length"));
    return std::vector<Compared>{{c.radiance}, {c.transmittance}};
  };
  f.differentiate = {"density", "colour"};
  return case_of("field", name, f);
}

/// Points of a march from `points` metres along `directions`.
StabilityCase marched(const std::string& name, Tensor points, Tensor directions) {
  Formula f{.inputs = {{"points", std::move(points)},
                       {"directions", std::move(directions)},
                       {"range", Tensor(Shape{1, 3, 1, 1}, 2)}}};
  f.build = [](Graph&, const Values& v) {
    const Marched m = march(v.at("points"), v.at("directions"), v.at("range"), v.at("points").shape(),
                            {.segments = kSegments, .jitter = false});
    return std::vector<Compared>{{m.position, false}, {m.length, false}};
  };
  return case_of("field", name, f);
}

/// Painted spheres asked from `points` metres along `directions`.
StabilityCase painted(const std::string& name, Tensor points, Tensor directions) {
  Formula f{.inputs = {{"shells", random_tensor({3, 4, 16, 32}, 10, 0, 2)},
                       {"points", std::move(points)},
                       {"directions", std::move(directions)},
                       {"range", Tensor(Shape{1, 3, 1, 1}, 2)}}};
  f.build = [](Graph&, const Values& v) {
    return std::vector<Compared>{
        {ask_shells(v.at("shells"), v.at("points"), v.at("directions"), v.at("range"), {}, {0.5, 1, 3})}};
  };
  return case_of("field", name, f);
}

/// One lobe a ray, looked at from within 1e-5 of its axis to its back; the numbers behind its sharpness and its weight
/// from `low` to `high` of [0, 1].
StabilityCase gaussians(const std::string& name, double low, double high) {
  const Shape vectors{1, 3, kPixels, kSamples}, numbers{1, 1, kPixels, kSamples};
  const Tensor axis = unit_tensor(vectors, 5), aside = unit_tensor(vectors, 6);
  const std::vector<double> distance = spread_logarithms(kPixels * kSamples, 1e-5, 100, 7);
  Tensor direction(vectors);
  for (int p = 0; p < kPixels; ++p)
    for (int s = 0; s < kSamples; ++s) {
      const double away = distance[static_cast<std::size_t>(p * kSamples + s)];
      Vector3 v;
      for (int c = 0; c < 3; ++c) v[static_cast<std::size_t>(c)] = axis.at(0, c, p, s) + away * aside.at(0, c, p, s);
      v = unit_of(v);
      for (int c = 0; c < 3; ++c) direction.at(0, c, p, s) = v[static_cast<std::size_t>(c)];
    }
  Formula f{.inputs = {{"axis", axis},
                       {"sharpness", random_tensor(numbers, 8, low, high)},
                       {"weight", random_tensor(vectors, 9, low, high)},
                       {"direction", direction}}};
  f.build = [](Graph&, const Values& v) {
    const auto number = [&](const char* of) { return activate(v.at(of), Function::Tangent); };
    const Gaussians lobes{v.at("axis"), number("sharpness"), number("weight")};
    return std::vector<Compared>{{spherical_gaussians(lobes, v.at("direction"))}};
  };
  f.differentiate = {"axis", "sharpness", "weight", "direction"};
  return case_of("field", name, f);
}

}  // namespace

std::vector<StabilityCase> field_stability() {
  std::vector<StabilityCase> cases;
  for (const double thickness : {1e-8, 1e-4, 1.0, 1e4, 1e8})
    cases.push_back(composited(fmt::format("density times step {:g}", thickness), 0.5 * thickness, 2 * thickness));
  cases.push_back(composited("density times step 1e-8 to 1e8 on one ray", 1e-8, 1e8));
  cases.push_back(composited("density 0", 0, 0));
  const Shape rays{1, 3, kPixels, kSamples};
  const Tensor anywhere = random_tensor(rays, 4), inside = random_tensor(rays, 3, -2, 2);
  cases.push_back(marched("marched from within the sphere", inside, anywhere));
  cases.push_back(marched("marched from far beyond the sphere", random_tensor(rays, 3, 100, 200), anywhere));
  cases.push_back(marched("marched along no direction", inside, Tensor(rays, 0)));
  cases.push_back(painted("painted spheres asked from within", inside, anywhere));
  cases.push_back(painted("painted spheres asked along no direction", inside, Tensor(rays, 0)));
  cases.push_back(gaussians("spherical Gaussians, numbers of 0 to 1", 0, 1));
  cases.push_back(gaussians("spherical Gaussians, numbers of 0 to 1e-7", 0, 1e-7));
  cases.push_back(gaussians("spherical Gaussians, numbers of 0.999 to 1", 0.999, 1));
  return cases;
}

}  // namespace clerestory
