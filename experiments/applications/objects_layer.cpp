#include "experiments/applications/objects_layer.hpp"

#include "experiments/applications/objects_light.hpp"
#include "host/cl/seconds_of.hpp"
#include "host/ops/light/surface_points.hpp"

namespace clerestory {
namespace {

Tensor material_table(const std::vector<InsertedObject>& objects) {
  Tensor table({static_cast<int>(objects.size()), 5, 1, 1});
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const InsertedObject& o = objects[i];
    const std::array<double, 5> row{o.albedo[0], o.albedo[1], o.albedo[2], o.roughness, o.metallic};
    std::copy(row.begin(), row.end(), table.real.begin() + static_cast<std::ptrdiff_t>(5 * i));
  }
  return table;
}

/// A pixel's rays skip its own cell where it shows the scene; an object floats before its cell.
Tensor skip_map(const Image& shows) {
  std::vector<int> skip(shows.pixels());
  for (std::size_t i = 0; i < skip.size(); ++i) skip[i] = shows.data[i] > 0 ? -1 : static_cast<int>(i);
  return Tensor::of_int({1, 1, shows.height, shows.width}, std::move(skip));
}

}  // namespace

ObjectsLayer::ObjectsLayer(Device& device, const Scene& scene, std::shared_ptr<TraceObjects> objects,
                           const std::vector<InsertedObject>& list, const RenderSettings& settings, int bounces)
    : device_(device) {
  const SceneValues v = scene_values(graph_, scene);
  const Shape map1{1, 1, scene.height(), scene.width()}, map3{1, 3, scene.height(), scene.width()};
  const Value depth = graph_.input("scene depth", map1), normal = graph_.input("scene normal", map3);
  const Value shows = graph_.input("shows", map1), skip = graph_.input("skip", map1, Type::Int);
  const Value materials = graph_.input("materials", {static_cast<int>(list.size()), 5, 1, 1});
  const ObjectsLightInputs inputs{
      ssrt_scene(depth, normal), v.range, surface_points(v.maps.depth, v.camera), skip, shows, materials};
  const SceneLight light = scene_light(graph_, v, scene, settings);
  RenderSpec spec = render_spec(settings, light);
  spec.trace = false;  // objects_light() does, where it must
  rendered_ = render(graph_, spec, v.maps, v.camera, v.range, inputs_of(inputs, light),
                     objects_light(std::move(objects), light, spec.ssrt, bounces));

  executor_.emplace(compile(graph_, {rendered_.radiance, rendered_.status, rendered_.tally}, device), light.states);
  executor_->after_chunk(settings.after_chunk);
  feed_scene(*executor_, scene);  // range and ambient light stay the scene's, whatever objects are before it
  light.feed(*executor_);
  executor_->feed("scene depth", tensor_of(scene.depth)), executor_->feed("scene normal", tensor_of(scene.normal));
  executor_->feed("materials", material_table(list));
}

Image ObjectsLayer::radiance(const SceneWithObjects& with, std::uint32_t seed) {
  feed_maps(*executor_, with.scene);
  executor_->feed("shows", tensor_of(with.shows)), executor_->feed("skip", skip_map(with.shows));
  seconds_ += seconds_of(device_, [&] { executor_->run(seed); });
  const Tensor status = executor_->fetch(rendered_.status);
  dropped_ += render_counts(status, executor_->fetch(rendered_.tally)).dropped;
  Image picture(with.shows.width, with.shows.height, 3);
  picture.data = executor_->fetch_floats(rendered_.radiance);
  return picture;
}

}  // namespace clerestory
