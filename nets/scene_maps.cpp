#include "nets/scene_maps.hpp"

namespace clerestory {

Tensor tensor_of(const Image& image) { return Tensor({1, image.channels, image.height, image.width}, image.data); }

Image fetch_image(Executor& executor, Value value) {
  const Shape& s = value.shape();
  Image image(s.w, s.h, s.c);
  image.data = executor.fetch_floats(value);
  return image;
}

std::vector<Image> pictures_by(Device& device, const Graph& graph, const std::vector<Value>& values) {
  Executor executor(compile(graph, values, device));
  executor.run();
  std::vector<Image> pictures;
  for (const Value& value : values) pictures.push_back(fetch_image(executor, value));
  return pictures;
}

SceneValues scene_values(Graph& graph, const Scene& scene) {
  const auto map = [&](const std::string& name, int channels) {
    return graph.input(name, {1, channels, scene.height(), scene.width()});
  };
  SceneValues values;
  values.photo = map("photo", 3);
  values.maps.depth = map("depth", 1);
  values.maps.surfaces = {map("albedo", 3), map("normal", 3), map("material", 3)};
  values.camera = graph.input("camera", {1, 4, 1, 1});
  values.range = graph.input("range", {1, 3, 1, 1});
  values.ambient = graph.input("ambient", {1, 3, 1, 1});
  return values;
}

void feed_scene(Executor& executor, const Scene& scene) {
  const std::array<double, 3> ambient = ambient_of(scene);
  feed_maps(executor, scene);
  executor.feed("photo", tensor_of(scene.photo));
  executor.feed("range", depth_range(tensor_of(scene.depth)));
  executor.feed("ambient", Tensor({1, 3, 1, 1}, std::vector<double>(ambient.begin(), ambient.end())));
}

std::map<std::string, Tensor> map_feeds(const Scene& scene) {
  return {{"albedo", tensor_of(scene.albedo)},
          {"normal", tensor_of(scene.normal)},
          {"depth", tensor_of(scene.depth)},
          {"material", tensor_of(scene.material)},
          {"camera", camera_tensor(std::span(&scene.camera, 1))}};
}

void feed_maps(Executor& executor, const Scene& scene) {
  for (const auto& [name, map] : map_feeds(scene)) executor.feed(name, map);
}

}  // namespace clerestory
