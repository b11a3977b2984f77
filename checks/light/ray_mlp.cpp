// The in-view light's MLP along rays, forward and back, against plain double arithmetic.
#include "host/ops/light/ray_mlp.hpp"

#include "checks/light/ask_mlp_reference.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace ask_mlp_reference;

std::vector<Rounded> column(const Tensor& t, int first, int count, int p, int s) {
  std::vector<Rounded> numbers;
  for (int c = first; c < first + count; ++c) numbers.push_back({t.at(0, c, p, s), 0});
  return numbers;
}

/// f, and how many epsilons rounding may take from the number that it harms most.
std::pair<Tensor, double> plain_ray_mlp(const Mlp& m, const Tensors& t) {
  const Shape& rays = t.at("encoded").shape;
  std::pair<Tensor, double> answer{Tensor(Shape{1, 3, rays.h, rays.w}), 0};
  for (int p = 0; p < rays.h; ++p)
    for (int s = 0; s < rays.w; ++s) {
      const std::vector<Rounded> encoded = column(t.at("encoded"), 0, 2 * m.waves, p, s);
      std::vector<Rounded> numbers;
      for (int layer = 0; layer < m.layers; ++layer) {
        std::vector<Rounded> next(static_cast<std::size_t>(m.width));
        if (m.reads(layer)) next = column(t.at("input"), layer > 0 ? m.width : 0, m.width, p, s);
        for (int k = 0; k < m.width; ++k) {
          Rounded& sum = next[static_cast<std::size_t>(k)];
          if (m.reads(layer)) add_product(sum, t.at(direction_name(layer)), k, encoded);
          sum.add(t.at(bias_name(layer)).at(0, k, 0, 0), 0);
          if (layer > 0) add_product(sum, t.at(hidden_name(layer)), k, numbers);
          sum.value = std::max(sum.value, 0.0);
        }
        numbers = next;
      }
      for (int c = 0; c < 3; ++c) {
        Rounded f;
        f.add(t.at("out_bias").at(0, c, 0, 0), 0);
        add_product(f, t.at("out"), c, numbers);
        answer.first.at(0, c, p, s) = f.value;
        answer.second = std::max(answer.second, kDeviations * f.deviation);
      }
    }
  return answer;
}

OpCase ray_mlp_case(const std::string& label, const Mlp& m, Tensors inputs) {
  OpCase c{.stem = "ray_mlp", .label = label, .inputs = std::move(inputs)};
  c.kernels = {"pack_layer", "ray_mlp", "ray_mlp_slopes", "ray_mlp_weights"};
  c.build = [=](Graph&, const Values& v) { return std::vector{ray_mlp(net_of(m, v), v.at("input"), v.at("encoded"))}; };
  c.reference = [=](const Tensors& t) { return std::vector{plain_ray_mlp(m, t).first}; };
  c.roundings = plain_ray_mlp(m, c.inputs).second, c.magnitude = 1;
  for (const auto& [name, tensor] : c.inputs) c.differentiate.push_back(name);
  // A step so small that next to no relu turns within it; what rounding then leaves of a difference is 1e-8 of it.
  c.step = 1e-7, c.gradient_tolerance = 1e-6, c.differences = 20;
  return c;
}

OP_CASES(ray_mlp) {
  const auto made = [](const std::string& label, const Mlp& m, int rows, int samples) {
    return ray_mlp_case(label, m, ray_inputs(m, rows, samples));
  };
  const Mlp thin{.width = 16};
  return {made("plain", {}, 3, 32),
          made("whole_blocks", thin, 6, 48),  // of rays, and three of them at a time
          made("odd_rays", {.width = 16, .again = 1}, 7, 29),
          made("one_ray", {.width = 16, .layers = 4, .again = 2}, 1, 1),
          made("odd_width", {.width = 21, .waves = 5, .again = 2}, 5, 10),
          made("input_again_last", {.width = 16, .again = 2}, 3, 16),
          made("one_layer", {.layers = 1}, 2, 16),
          made("compact", {.width = 128, .layers = 2, .waves = 30, .again = 1}, 2, 30),
          made("wide", {.width = 512, .layers = 2, .waves = 3}, 2, 16),
          made("most_features", {.width = 16, .layers = 1, .waves = 512}, 1, 16),
          made("silent", {.width = 16, .gain = 0}, 2, 16)};
}

}  // namespace
}  // namespace clerestory
