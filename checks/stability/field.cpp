// The field out of view: volume rendering of segments thin and thick, and where it is looked at.
#include <cmath>

#include "checks/stability/stability_case.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/light/march.hpp"

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
  return cases;
}

}  // namespace clerestory
