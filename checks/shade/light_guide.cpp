// Rows of guides against the same formulas in double.
#include "host/ops/shade/light_guide.hpp"

#include "checks/op_case.hpp"
#include "checks/shade/light_guide_reference.hpp"

namespace clerestory {
namespace {

using namespace light_guide_reference;

OpCase rows_case(const std::string& label, Tensor known) {
  OpCase c{.stem = "light_guide", .label = label, .kernels = {"light_guide"}, .inputs = maps(20)};
  c.inputs["lamps"] = std::move(known);
  c.build = [](Graph&, const Values& v) {
    const Surfaces surfaces{v.at("albedo"), v.at("normal"), v.at("material")};
    return std::vector<Value>{light_guide(v.at("depth"), v.at("camera"), surfaces, v.at("lamps"), kRows)};
  };
  c.reference = [](const Tensors& t) { return std::vector<Tensor>{guide_rows(t)}; };
  c.roundings = 32;  // a squared distance over a squared size, and a probability times that
  c.no_gradient = "it only chooses directions";
  return c;
}

OP_CASES(light_guide) { return {rows_case("rows", lamps()), rows_case("of_each_picture", lamps_of_each_picture())}; }

}  // namespace
}  // namespace clerestory
