// Lists of rays, and a part of them, for kernels that hold a whole net.
#pragma once
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "checks/op_case.hpp"
#include "host/ops/light/select_rays.hpp"

namespace clerestory {

inline RayList list_of(Graph& g, const std::vector<int>& rays, const Shape& of) {
  std::vector<int> all(static_cast<std::size_t>(of.plane()), -1);
  std::copy(rays.begin(), rays.end(), all.begin());
  return {g.constant(Tensor::of_int({1, 1, of.h, of.w}, all)),
          g.constant(Tensor::of_int({1, 1, 1, 1}, {static_cast<int>(rays.size())}))};
}

/// What stands between products in place of the one kernel (kernels/light/net_products.cl).
inline const std::vector<std::string>& product_kernels_of(const std::string& stem) {
  static const std::map<std::string, std::vector<std::string>> kernels{
      {"ask_mlp", {"begin_layer", "encode_directions", "add_rows", "put_answers"}},
      {"ask_field", {"begin_layer", "encode_points", "composite_points"}}};
  static const std::vector<std::string> none;
  const auto found = kernels.find(stem);
  return found == kernels.end() ? none : found->second;
}

/// A case of a net asked in one kernel, of all rays or of those listed: `ask` builds it from values and list, `answer`
/// gives what plain arithmetic says, and how many roundings it may be off.
template <class Ask, class Answer>
OpCase inference_case(const std::string& stem, const std::string& label, Tensors inputs, const std::vector<int>& list,
                      const Ask& ask, const Answer& answer) {
  OpCase c{.stem = stem, .label = label, .kernels = {"pack_layer", stem}};
  c.product_kernels = product_kernels_of(stem), c.inputs = std::move(inputs);
  const Shape rays = c.inputs.at("direction").shape;
  c.build = [=](Graph& g, const Values& v) {
    return std::vector<Value>{ask(v, list.empty() ? RayList{} : list_of(g, list, rays))};
  };
  c.reference = [=](const Tensors& t) { return std::vector<Tensor>{answer(t).first}; };
  const auto [want, roundings] = answer(c.inputs);
  c.magnitude = 1;
  for (const double x : want.real) c.magnitude = std::max(c.magnitude, std::abs(x));
  c.roundings = roundings / c.magnitude;  // which are of 1
  c.no_gradient = "for inference: throws";
  return c;
}

/// 1, 1 + step, ... below count.
inline std::vector<int> every(int step, int count) {
  std::vector<int> list;
  for (int i = 1; i < count; i += step) list.push_back(i);
  return list;
}

/// Rows 2 to 5, samples 16 to 31 of the rays {"points", "direction"}, in a tile with room for a row more.
inline Tensors tile_of(const Tensors& inputs) {
  Tensors part = inputs;
  for (const char* name : {"points", "direction"}) {
    part[name] = random_tensor({1, 3, 5, 16}, 9);
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < 4; ++p)
        for (int s = 0; s < 16; ++s) part[name].at(0, c, p, s) = inputs.at(name).at(0, c, p + 2, s + 16);
  }
  return part;
}

}  // namespace clerestory
