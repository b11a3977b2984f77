// How fast the rendering layer is on a device.
#include <algorithm>
#include <cmath>

#include "host/cl/seconds_of.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/light/bench_room.hpp"
#include "host/ops/shade/render.hpp"

namespace clerestory {

LayerSpeed layer_speed(Device device, int width, int height, const RenderSpec& spec, int repeats) {
  const auto [camera, depth, normal] = bench_room(width, height);
  Tensor material(Shape{1, 2, height, width});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      material.at(0, 0, y, x) = 0.1 + 0.8 * x / width;
      material.at(0, 1, y, x) = y % 64 < 16 ? 1 : 0;
    }
  const std::map<std::string, Tensor> feeds{{"depth", depth},
                                            {"normal", normal},
                                            {"material", material},
                                            {"albedo", Tensor(Shape{1, 3, height, width}, 0.6)},
                                            {"image", Tensor(Shape{1, 3, height, width}, 0.5)},
                                            {"ambient", Tensor(Shape{1, 3, 1, 1}, 0.3)},
                                            {"camera", camera_tensor(std::span(&camera, 1))},
                                            {"range", depth_range(depth)}};
  Graph graph;
  std::map<std::string, Value> in;
  for (const auto& [name, tensor] : feeds) in[name] = graph.input(name, tensor.shape);
  const std::vector<Value> light{in["image"], in["ambient"]};
  const Rendered rendered = render(graph, spec, {in["depth"], {in["albedo"], in["normal"], in["material"]}},
                                   in["camera"], in["range"], light, image_light_builder());
  Executor executor(compile(graph, {rendered.radiance, rendered.standard_error, rendered.uncertainty}, device));
  for (const auto& [name, tensor] : feeds) executor.feed(name, tensor);

  LayerSpeed speed;
  speed.seconds = INFINITY;
  for (int r = 0; r <= repeats; ++r) {  // the first builds the kernels
    device.reset_memory_peak();
    const double seconds = seconds_of(device, [&] { executor.run(static_cast<std::uint32_t>(r)); });
    if (r > 0) speed.seconds = std::min(speed.seconds, seconds);
    speed.peak_bytes = std::max(speed.peak_bytes, device.memory_peak());
  }
  speed.million_samples_per_second = 1e-6 * width * height * spec.spp / speed.seconds;
  device.set_profiling(true);
  device.reset_profile();
  executor.run(0);
  speed.kernels = device.profile();
  device.set_profiling(false);
  return speed;
}

}  // namespace clerestory
