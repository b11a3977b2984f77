#include "experiments/applications/estimate.hpp"

#include <algorithm>

#include "experiments/evaluation/prepare.hpp"
#include "host/graph/plan.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {
namespace {

double flops_of(const Plan& plan) {
  double flops = 0;
  for (const Step& step : plan.steps) flops += step.node->op->cost(*step.node).flops;
  return flops;
}

double maps_flops(Device& device, const std::string& preset, const Size& size, const PredictRequest& request) {
  if (!request.any()) return 0;
  Graph graph;
  const Value image = graph.input("image", {1, 3, padded_size(size.height), padded_size(size.width)});
  const Maps maps = mgnet(graph, image, mgnet_size(preset), false);
  return 2 * flops_of(compile(graph, wanted_outputs(maps, request), device));  // the photograph, and its mirror image
}

double encoders_flops(Device& device, const LightSizes& sizes, const Size& size) {
  Graph graph;
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, size.height, size.width), sizes, false)[0];
  std::vector<Value> outputs{picture.pixels.features, picture.pixels.surface};
  outputs.insert(outputs.end(), picture.field.weights.begin(), picture.field.weights.end());
  outputs.insert(outputs.end(), picture.field.biases.begin(), picture.field.biases.end());
  if (picture.field.shells) outputs.push_back(picture.field.shells);
  return flops_of(compile(graph, outputs, device));
}

std::string flops_text(double flops) {
  return flops < 1e12 ? fmt::format("{:.1f} GFLOP", flops * 1e-9) : fmt::format("{:.1f} TFLOP", flops * 1e-12);
}

}  // namespace

InvertWork invert_work(Device& device, const std::string& preset, int width, int height, const PredictRequest& request,
                       const AskedLight& light) {
  const Size size = net_size(width, height, preset == "paper" ? 320 : 160);
  InvertWork work;
  work.maps = maps_flops(device, preset, size, request);
  if (light.rays == 0 || !is_learned_light(light.name) || light.name == "li2020") return work;
  work.encoders = encoders_flops(device, light.net, size);
  if (light.name == "net") work.in_view = light.rays * in_view_flops(light.net.in_view);
  work.out_of_view = light.rays * out_of_view_flops(light.net.out_of_view);
  return work;
}

std::string describe(const InvertWork& work, double peak_gflops) {
  std::string text = "maps " + flops_text(work.maps);
  if (work.in_view + work.out_of_view > 0)
    text += fmt::format(", light {} once and at most {} for rays ({} in view, {} out of view)",
                        flops_text(work.encoders), flops_text(work.in_view + work.out_of_view),
                        flops_text(work.in_view), flops_text(work.out_of_view));
  return text + fmt::format(": {:.0f} s at the measured peak of {:.0f} GFLOP/s, which no kernel reaches",
                            work.all() / (peak_gflops * 1e9), peak_gflops);
}

}  // namespace clerestory
