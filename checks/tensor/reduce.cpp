// Sums and means along axes.
#include "host/ops/tensor/reduce.hpp"

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/tensor/shapes.hpp"

namespace clerestory {
namespace {

Tensor summed(const Tensor& x, const Shape& to, double factor) {
  Tensor out(to);
  for (int n = 0; n < x.shape.n; ++n)
    for (int c = 0; c < x.shape.c; ++c)
      for (int y = 0; y < x.shape.h; ++y)
        for (int i = 0; i < x.shape.w; ++i) broadcast(out, n, c, y, i) += factor * x.at(n, c, y, i);
  return out;
}

}  // namespace

OP_CASES(reduce) {
  std::vector<OpCase> cases;
  for (const Shape& to : kBroadcasts) {
    if (to == kFull) continue;
    std::vector<std::string> kernels;
    if (to.plane() == 1) kernels.push_back("sum_plane");
    if (to.c == 1) kernels.push_back("sum_channels");
    if (to.n == 1) kernels.push_back("sum_batch");
    cases.push_back({.stem = "reduce",
                     .label = "to_" + to.text(),
                     .kernels = kernels,
                     .inputs = {{"x", random_tensor(kFull, 4)}},
                     .build = [to](Graph&, const Values& v) { return std::vector<Value>{sum_to(v.at("x"), to, 0.4)}; },
                     .reference = [to](const Tensors& t) { return std::vector<Tensor>{summed(t.at("x"), to, 0.4)}; },
                     .roundings = 12,
                     .magnitude = 0.4 * std::sqrt(static_cast<double>(kFull.count())),
                     .differentiate = {"x"}});
  }
  cases.push_back({.stem = "reduce",
                   .label = "means",
                   .kernels = {"sum_plane", "sum_channels", "sum_batch"},
                   .inputs = {{"x", random_tensor({3, 2, 33, 41}, 5)}},
                   .build =
                       [](Graph&, const Values& v) {
                         return std::vector<Value>{mean(v.at("x")), sum(v.at("x")), plane_mean(v.at("x"))};
                       },
                   .reference =
                       [](const Tensors& t) {
                         const Tensor& x = t.at("x");
                         const double count = static_cast<double>(x.shape.count());
                         return std::vector<Tensor>{
                             summed(x, {}, 1 / count), summed(x, {}, 1),
                             summed(x, {3, 2, 1, 1}, 1.0 / static_cast<double>(x.shape.plane()))};
                       },
                   // 85 additions per lane of running sums no larger than 85; the sum is the largest of the outputs.
                   .roundings = 12,
                   .magnitude = 90,
                   .differentiate = {"x"},
                   .differences = 12});
  return cases;
}

}  // namespace clerestory
