#include "host/ops/nn/square_sums.hpp"

#include <fmt/format.h>

#include "checks/op_case.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

// More tensors than one launch takes, of unlike sizes; the last is a slice, whose items do not lie side by side.
const std::vector<Shape> kShapes{{3, 5, 1, 1},  {1, 7, 1, 1}, {4, 3, 3, 3}, {1, 1, 1, 1}, {2, 2, 2, 2},
                                 {1, 16, 1, 1}, {2, 4, 3, 3}, {1, 9, 1, 1}, {5, 5, 1, 1}, {2, 6, 5, 7}};

std::string name_of(std::size_t i) { return fmt::format("x{}", i); }

OP_CASES(square_sums) {
  OpCase c{.stem = "square_sums",
           .label = "unlike_shapes",
           .kernels = {"square_sums", "square_totals"},
           .build =
               [](Graph&, const Values& v) {
                 std::vector<Value> tensors;
                 for (std::size_t i = 0; i < kShapes.size(); ++i) tensors.push_back(v.at(name_of(i)));
                 tensors.push_back(slice(tensors.back(), 1, 3));
                 return std::vector<Value>{square_sums(tensors)};
               },
           .reference =
               [](const Tensors& t) {
                 Tensor sums({1, static_cast<int>(kShapes.size()) + 1, 1, 1});
                 for (std::size_t i = 0; i < kShapes.size(); ++i)
                   for (const double v : t.at(name_of(i)).real) sums.real[i] += v * v;
                 const Tensor& last = t.at(name_of(kShapes.size() - 1));
                 for (int n = 0; n < last.shape.n; ++n)
                   for (int channel = 1; channel < 4; ++channel)
                     for (int y = 0; y < last.shape.h; ++y)
                       for (int x = 0; x < last.shape.w; ++x)
                         sums.real.back() += last.at(n, channel, y, x) * last.at(n, channel, y, x);
                 return std::vector<Tensor>{sums};
               },
           .roundings = 32,  // 27 squares in a lane, then a tree of five
           .no_gradient = "what a training is watched by"};
  for (std::size_t i = 0; i < kShapes.size(); ++i) c.inputs[name_of(i)] = random_tensor(kShapes[i], i);
  return {c};
}

}  // namespace
}  // namespace clerestory
