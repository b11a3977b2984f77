// Gradients of biases against sums in double.
#include "host/ops/nn/conv_bias.hpp"

#include "checks/op_case.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

/// `roundings`: of a lane's stretch, of its stretches, and of the tree over lanes.
OpCase bias_case(const std::string& label, const Shape& dy, double roundings) {
  OpCase c{.stem = "conv_bias", .label = label, .kernels = {"conv_bias_gradient"}};
  c.inputs = {{"dy", random_tensor(dy, 3)}};
  c.build = [](Graph&, const Values& v) { return std::vector{conv_bias_gradient(v.at("dy"))}; };
  c.reference = [](const Tensors& t) {
    const Tensor& g = t.at("dy");
    Tensor db({1, g.shape.c, 1, 1});
    for (int n = 0; n < g.shape.n; ++n)
      for (int channel = 0; channel < g.shape.c; ++channel)
        for (int y = 0; y < g.shape.h; ++y)
          for (int x = 0; x < g.shape.w; ++x) db.at(0, channel, 0, 0) += g.at(n, channel, y, x);
    return std::vector{db};
  };
  c.roundings = roundings;
  c.no_gradient = "a gradient";
  return c;
}

OP_CASES(conv_bias) {
  // Of 16 lanes: one number each, less than a row of lanes, several stretches of 4096 of which the last is short.
  OpCase slices = bias_case("slice", {3, 5, 3, 7}, 16);
  slices.build = [](Graph&, const Values& v) { return std::vector{conv_bias_gradient(slice(v.at("dy"), 1, 3))}; };
  const auto whole = slices.reference;
  slices.reference = [whole](const Tensors& t) {
    const Tensor all = whole(t)[0];
    Tensor some({1, 3, 1, 1});
    for (int channel = 0; channel < 3; ++channel) some.at(0, channel, 0, 0) = all.at(0, channel + 1, 0, 0);
    return std::vector{some};
  };
  return {bias_case("one_pixel", {2, 3, 1, 1}, 8), bias_case("batch", {2, 3, 5, 7}, 16),
          bias_case("stretches", {2, 2, 90, 101}, 300), slices};
}

}  // namespace
}  // namespace clerestory
