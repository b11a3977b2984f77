// The radiance field in one kernel, against plain double arithmetic.
#include "host/ops/light/ask_field.hpp"

#include "checks/light/ask_field_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace ask_field_reference;

/// Against exact arithmetic: start, direction and distance of a point are each rounded at the size of the sphere.
Uncertain against_exact(const Field& f) { return {4 * f.options.march.radius, 1}; }

OpCase field_case(const std::string& label, const Field& f, Tensors inputs, const std::vector<int>& list = {}) {
  const auto answer = [=](const Tensors& t) {
    const auto a = plain_answer(f, t, list, against_exact(f));
    return std::pair{a.radiance, a.roundings};
  };
  return inference_case(
      "ask_field", label, std::move(inputs), list,
      [=](const Values& v, const RayList& rays) { return ask(f, v, rays); }, answer);
}

OP_CASES(ask_field) {
  Field soft;
  soft.options.released_output = false;
  const Field released;
  Field deep{.hidden = {64, 48, 17, 64}};
  deep.options.octaves = 3;
  Field single{.hidden = {}};
  single.options.octaves = 10, single.options.march.segments = 1;
  Field solid = soft, empty;
  solid.density_bias = 1e6;
  empty.density_gain = 0, empty.density_bias = -1;
  Field murky = soft;  // optical depths around the end
  murky.density_bias = 10, murky.options.march.segments = 12;
  Field thin = soft, bare = empty, dense = solid;
  thin.density_bias = -2;
  thin.background = bare.background = dense.background = true;
  return {field_case("softplus", soft, field_inputs(soft, 3, 32)),
          field_case("relu", released, field_inputs(released, 3, 32)),
          field_case("point_per_row", released, field_inputs(released, 5, 16, true)),
          field_case("listed", soft, field_inputs(soft, 7, 16), every(3, 112)),
          field_case("one_ray", soft, field_inputs(soft, 2, 16), {17}),
          field_case("five_layers", deep, field_inputs(deep, 2, 16)),
          field_case("one_layer", single, field_inputs(single, 2, 16)),
          field_case("solid", solid, field_inputs(solid, 2, 16)),
          field_case("empty", empty, field_inputs(empty, 2, 16)),
          field_case("murky", murky, field_inputs(murky, 2, 16)),
          field_case("background", thin, field_inputs(thin, 3, 32), every(2, 96)),
          field_case("background_alone", bare, field_inputs(bare, 2, 16)),
          field_case("background_hidden", dense, field_inputs(dense, 2, 16))};
}

}  // namespace
}  // namespace clerestory
