// Means and statistics over the samples of a pixel, against sums in double.
#include "host/ops/shade/accumulate_samples.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/accumulate_samples_reference.hpp"

namespace clerestory {
namespace {

using namespace accumulate_samples_reference;

OP_CASES(accumulate_samples) {
  std::vector<OpCase> cases;
  for (const bool traced : {false, true}) {
    OpCase c{.stem = "accumulate_samples",
             .label = traced ? "traced" : "untraced",
             .kernels = {"accumulate_samples"},
             .inputs = sums_inputs()};
    c.build = [traced](Graph&, const Values& v) {
      const SampleSums s = accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"),
                                              traced ? v.at("u") : Value{}, traced ? v.at("hit") : Value{}, kCount);
      return std::vector<Value>{s.mean, s.squares, s.tally, s.first};
    };
    c.reference = [traced](const Tensors& t) { return sums_reference(t, traced); };
    c.roundings = 12;  // three terms a lane, compensated, and a tree of sixteen; squares double the error of x
    c.no_gradient = "squares and tally are statistics; the mean has a case of its own";
    cases.push_back(c);
  }
  OpCase mean = cases.front();
  mean.label = "mean";
  mean.kernels = {"accumulate_samples", "accumulate_samples_adjoint"};
  mean.build = [](Graph&, const Values& v) {
    return std::vector{accumulate_samples(v.at("weight"), v.at("radiance"), v.at("pdf"), {}, {}, kCount).mean};
  };
  mean.reference = [](const Tensors& t) { return std::vector{sums_reference(t, false)[0]}; };
  mean.no_gradient = {}, mean.differentiate = {"weight", "radiance"};
  mean.step = 1e-2, mean.gradient_tolerance = 1e-10;  // bilinear: a difference is exact but for rounding
  cases.push_back(mean);
  OpCase finish{.stem = "accumulate_samples", .label = "finish", .kernels = {"finish_samples"}};
  finish.inputs = {{"squares", random_tensor({2, 3, 4, 5}, 6, 0, 9)}, {"tally", random_tensor({2, 4, 4, 5}, 7, 5, 6)}};
  for (int n = 0; n < 2; ++n)
    finish.inputs["tally"].at(n, 1, 0, 0) = finish.inputs["tally"].at(n, 2, 0, 0);  // nothing left
  finish.build = [](Graph&, const Values& v) {
    const SampleStatistics s = finish_samples(v.at("squares"), v.at("tally"), 64, 2);
    return std::vector<Value>{s.standard_error, s.uncertainty};
  };
  finish.reference = [](const Tensors& t) {
    Tensor error(Shape{2, 3, 4, 5}), u(Shape{2, 1, 4, 5});
    for (int n = 0; n < 2; ++n)
      for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x) {
          for (int c = 0; c < 3; ++c) error.at(n, c, y, x) = std::sqrt(t.at("squares").at(n, c, y, x) / 62 / 64);
          const double used = t.at("tally").at(n, 1, y, x) - t.at("tally").at(n, 2, y, x);
          u.at(n, 0, y, x) = used > 0 ? t.at("tally").at(n, 0, y, x) / used : 0;
        }
    return std::vector<Tensor>{error, u};
  };
  // used is a difference of near numbers; but it is the same in float, whose inputs are rounded before.
  finish.roundings = 64;
  finish.no_gradient = "a statistic";
  cases.push_back(finish);
  return cases;
}

}  // namespace
}  // namespace clerestory
