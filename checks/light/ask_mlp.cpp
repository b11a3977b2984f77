// The in-view light's MLP in one kernel, against plain double arithmetic.
#include "host/ops/light/ask_mlp.hpp"

#include "checks/light/ask_mlp_reference.hpp"
#include "checks/light/listed_rays.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace ask_mlp_reference;

OpCase mlp_case(const std::string& label, const Mlp& m, Tensors inputs, const std::vector<int>& list = {}) {
  const auto answer = [=](const Tensors& t) {
    const auto a = plain_answer(m, t, list);
    return std::pair{a.f, a.roundings};
  };
  return inference_case(
      "ask_mlp", label, std::move(inputs), list, [=](const Values& v, const RayList& rays) { return ask(m, v, rays); },
      answer);
}

OP_CASES(ask_mlp) {
  const Mlp plain, again{.width = 48, .layers = 4, .waves = 5, .again = 2}, last{.layers = 3, .again = 2};
  const Mlp one{.layers = 1}, wide{.width = 512, .layers = 2, .waves = 3}, waves{.layers = 2, .waves = 256};
  const Mlp loud{.gain = 1e6}, silent{.gain = 0};
  Tensors misses = mlp_inputs(plain, 2, 16);
  for (int& pixel : misses["hit"].integer) pixel = -1;
  return {mlp_case("plain", plain, mlp_inputs(plain, 5, 32)),
          mlp_case("input_again", again, mlp_inputs(again, 3, 16)),
          mlp_case("input_again_last", last, mlp_inputs(last, 2, 16)),
          mlp_case("listed", plain, mlp_inputs(plain, 7, 16), every(3, 112)),
          mlp_case("one_ray", again, mlp_inputs(again, 2, 16), {17}),
          mlp_case("one_layer", one, mlp_inputs(one, 2, 16)),
          mlp_case("wide", wide, mlp_inputs(wide, 2, 16)),
          mlp_case("most_waves", waves, mlp_inputs(waves, 1, 16)),
          mlp_case("loud", loud, mlp_inputs(loud, 2, 16)),
          mlp_case("silent", silent, mlp_inputs(silent, 2, 16)),
          mlp_case("misses", plain, misses)};
}

}  // namespace
}  // namespace clerestory
