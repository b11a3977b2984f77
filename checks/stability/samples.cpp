// What the layer makes of its samples: radiance of any size weighed and summed, shares of two lights, whole pixels.
#include <cmath>

#include "checks/stability/stability_case.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/shade/accumulate_samples.hpp"

namespace clerestory {
namespace {

constexpr int kPixels = 512, kSamples = 32;
const Shape kColour{1, 3, kPixels, kSamples}, kNumber{1, 1, kPixels, kSamples};

Tensor scaled(Tensor t, double factor) {
  for (double& x : t.real) x *= factor;
  return t;
}

/// `value` in every seventh element.
Tensor with_some(Tensor t, double value) {
  for (std::size_t i = 0; i < t.real.size(); i += 7) t.real[i] = value;
  return t;
}

Tensor lit(std::uint64_t seed = 3) { return random_tensor(kColour, seed, 0.1, 2); }

/// The mean of weights times radiance, and its gradient by both. What it drops is what its tally says.
StabilityCase summed(const std::string& name, const Tensor& radiance, bool inside = true) {
  Formula f{.inputs = {{"weight", random_tensor(kColour, 1, 0.1, 1)},
                       {"radiance", radiance},
                       {"pdf", random_tensor(kNumber, 2, 0.1, 3)}}};
  f.build = [](Graph&, const Values& v) {
    const SampleSums sums = accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"), {}, {}, kSamples);
    return std::vector<Compared>{{sums.mean}, {sums.tally, false}};
  };
  f.differentiate = {"weight", "radiance"};
  StabilityCase c{.group = "samples", .name = name, .inside = inside};
  c.evaluate = [f](const Device& device, Precision precision) {
    Evaluations found = evaluate_formula(f, device, precision);
    const Tensor& tally = found.values[1].tensor;
    for (int p = 0; p < kPixels; ++p) found.dropped += tally.at(0, 2, p, 0);
    return found;
  };
  return c;
}

/// The standard error of a pixel's mean.
StabilityCase spread(const std::string& name, const Tensor& radiance) {
  Formula f{.inputs = {{"weight", random_tensor(kColour, 1, 0.1, 1)},
                       {"radiance", radiance},
                       {"pdf", random_tensor(kNumber, 2, 0.1, 3)}}};
  f.build = [](Graph&, const Values& v) {
    const SampleSums sums = accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"), {}, {}, kSamples);
    return std::vector<Compared>{{finish_samples(sums.squares, sums.tally, kSamples, 1).standard_error, false}};
  };
  return case_of("samples", name, f);
}

/// Light of the hit and of what is not seen, mixed by u.
StabilityCase mixed(const std::string& name, const Tensor& u) {
  Formula f{.inputs = {{"near", lit(4)}, {"far", lit(5)}, {"u", u}}};
  f.build = [](Graph&, const Values& v) {
    return std::vector<Compared>{{mix_light(v.at("near"), v.at("far"), v.at("u"))}};
  };
  f.differentiate = {"near", "far", "u"};
  return case_of("uncertainty", name, f);
}

}  // namespace

std::vector<StabilityCase> sample_stability() {
  Tensor negative = lit();
  for (std::size_t i = 0; i < negative.real.size(); i += 7) negative.real[i] *= -0.01;
  std::vector<StabilityCase> cases{summed("radiance 0", Tensor(kColour, 0)),
                                   summed("radiance 1e-30", scaled(lit(), 1e-30)),
                                   summed("radiance 1e30", scaled(lit(), 1e30)),
                                   summed("radiance negative in some rays", negative),
                                   summed("radiance Inf in some rays", with_some(lit(), INFINITY), false),
                                   summed("radiance NaN in some rays", with_some(lit(), NAN), false)};
  cases.push_back(spread("standard error at radiance 1e-15", scaled(lit(), 1e-15)));
  cases.push_back(spread("standard error at radiance 1e15", scaled(lit(), 1e15)));
  cases.push_back(spread("standard error of 1 beside 1e4", with_some(lit(), 1e4)));
  return cases;
}

std::vector<StabilityCase> uncertainty_stability() {
  return {mixed("u 0", Tensor(kNumber, 0)), mixed("u saturated, 1", Tensor(kNumber, 1)),
          mixed("u next to 1", Tensor(kNumber, 1 - 0x1p-24)), mixed("u 1e-30", Tensor(kNumber, 1e-30))};
}

}  // namespace clerestory
