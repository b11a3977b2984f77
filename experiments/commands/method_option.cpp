#include "experiments/commands/method_option.hpp"

#include "experiments/weights/method.hpp"
#include "host/error.hpp"

namespace clerestory {
namespace {

void must_be_alone(const CommonOptions& common, const std::filesystem::path& weights, const char* option) {
  if (!weights.empty())
    throw usage_error("a method names these weights as well", option, weights.string(),
                      "none beside --method " + common.method);
}

}  // namespace

std::filesystem::path take_method(const CommonOptions& common, RenderSettings& render, LightChoice& lit_by) {
  std::filesystem::path maps = common.weights;
  const bool asked = was_given(common, "--light");
  if (!common.method.empty()) {
    must_be_alone(common, common.weights, "--weights"), must_be_alone(common, lit_by.weights, "--light-weights");
    const Method method = find_method(common.method, "--method");
    maps = method.maps;
    if (!asked || is_learned_light(common.light)) lit_by.weights = method.light_weights;
  }
  choose_light(render, lit_by, common.light, asked);
  return maps;
}

}  // namespace clerestory
