#include "nets/scene_layer.hpp"

#include "host/cl/seconds_of.hpp"
#include "host/ops/light/surface_points.hpp"
#include "nets/scene_light.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {

SceneLayer::SceneLayer(Device& device, const Scene& scene, const RenderSettings& settings)
    : device_(device), geometry_(scene) {
  const SceneValues v = scene_values(graph_, scene);
  const Value solid = graph_.input("solid", {1, 1, scene.height(), scene.width()});
  const Value skip = graph_.input("skip", {1, 1, scene.height(), scene.width()}, Type::Int);
  // Rays start from the pixels to shade alone and are traced against the whole scene.
  const SceneLight light = scene_light(graph_, v, scene, settings);
  rendered_ = render(graph_, render_spec(settings, light), v.maps, v.camera, v.range,
                     inputs_of(light, surface_points(v.maps.depth, v.camera)), builder_of(light),
                     {solid, v.maps.surfaces.normal, skip});
  executor_.emplace(compile(graph_, {rendered_.radiance, rendered_.status, rendered_.tally}, device), light.states);
  executor_->after_chunk(settings.after_chunk);
  feed_scene(*executor_, scene);
  light.feed(*executor_);
  executor_->feed("solid", tensor_of(scene.depth));
  std::vector<int> own(scene.photo.pixels());
  for (std::size_t i = 0; i < own.size(); ++i) own[i] = static_cast<int>(i);
  executor_->feed("skip", Tensor::of_int({1, 1, scene.height(), scene.width()}, std::move(own)));
}

Image SceneLayer::radiance(const Image& albedo, const Image& material, const Image& light,
                           const std::array<double, 3>& ambient, const std::vector<bool>& shade, std::uint32_t seed) {
  Image depth = geometry_.depth;
  for (std::size_t i = 0; i < shade.size(); ++i)
    if (!shade[i]) depth.data[i] = 0;
  executor_->feed("depth", tensor_of(depth));
  executor_->feed("albedo", tensor_of(albedo)), executor_->feed("material", tensor_of(material));
  executor_->feed("photo", tensor_of(light));
  executor_->feed("ambient", Tensor({1, 3, 1, 1}, std::vector<double>(ambient.begin(), ambient.end())));
  seconds_ += seconds_of(device_, [&] { executor_->run(seed); });
  const Tensor status = executor_->fetch(rendered_.status);
  counts_ = render_counts(status, executor_->fetch(rendered_.tally));
  shaded_.assign(shade.size(), false);
  for (std::size_t i = 0; i < shade.size(); ++i) shaded_[i] = status.real[i] == 0;
  return fetch_image(*executor_, rendered_.radiance);
}

}  // namespace clerestory
