// Rows of guides against the same formulas in double.
#include "host/ops/shade/light_guide.hpp"

#include "checks/op_case.hpp"
#include "checks/shade/light_guide_reference.hpp"

namespace clerestory {
namespace {

using namespace light_guide_reference;

OP_CASES(light_guide) {
  OpCase c{.stem = "light_guide", .label = "rows", .kernels = {"light_guide"}, .inputs = maps(20)};
  c.inputs["lamps"] = lamps();
  c.build = [](Graph&, const Values& v) {
    const Surfaces surfaces{v.at("albedo"), v.at("normal"), v.at("material")};
    return std::vector<Value>{light_guide(v.at("depth"), v.at("camera"), surfaces, v.at("lamps"), kRows)};
  };
  c.reference = [](const Tensors& t) { return std::vector<Tensor>{guide_rows(t)}; };
  c.roundings = 32;  // a squared distance over a squared size, and a probability times that
  c.no_gradient = "it only chooses directions";
  return {c};
}

}  // namespace
}  // namespace clerestory
