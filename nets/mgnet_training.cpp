#include "nets/mgnet_training.hpp"

namespace clerestory {

MgnetTraining mgnet_training(Graph& graph, const MgnetSize& size, const MgnetTrainingOptions& options) {
  const auto map = [&](const char* name, int channels) {
    return graph.input(name, {options.batch, channels, options.height, options.width});
  };
  const auto per_picture = [&](const char* name) { return graph.input(name, {options.batch, 1, 1, 1}); };
  const Value image = map("image", 3);
  MapTargets truth;
  truth.albedo = map("albedo", 3), truth.normal = map("normal", 3), truth.material = map("material", 2),
  truth.depth = map("depth", 1);
  truth.albedo_mask = map("albedo_mask", 1), truth.geometry_mask = map("geometry_mask", 1),
  truth.material_mask = map("material_mask", 1);
  truth.log_scale = per_picture("log_scale"), truth.scale_mask = per_picture("scale_mask");
  const Value rate = graph.input("learning_rate", {}), step = graph.input("step", {});

  MgnetTraining training;
  training.maps = mgnet(graph, image, size, true);
  training.losses = mgnet_losses({graph, true, ""}, training.maps, truth, options.weights);
  const std::vector<Value> parameters = graph.parameters();
  adam(parameters, gradient(training.losses.front().second, parameters), rate, step, options.adam);
  return training;
}

}  // namespace clerestory
