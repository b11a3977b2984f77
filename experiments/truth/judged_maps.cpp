#include "experiments/truth/judged_maps.hpp"

#include <algorithm>

#include "host/math/statistics.hpp"

namespace clerestory {

PreparedView prepare_scene(const Scene& scene, int width, int height) {
  RoomView view;
  view.image = scene.photo, view.albedo = scene.albedo, view.depth = scene.depth;
  view.normal = scene.normal, view.material = scene.material, view.camera = scene.camera;
  view.mask = Image(scene.width(), scene.height(), 1), view.emission = Image(scene.width(), scene.height(), 3);
  for (std::size_t i = 0; i < view.mask.pixels(); ++i) {
    view.mask.data[i] = scene.depth.data[i] > 0;
    for (int c = 0; c < 3; ++c) view.emission->plane(c)[i] = scene.material.plane(2)[i];
  }
  return prepare_view(view, width, height);
}

MapSet relative_maps(const Scene& scene, double* scale) {
  MapSet maps{scene.albedo, scene.normal, scene.depth, Image(scene.width(), scene.height(), 2)};
  std::copy_n(scene.material.data.begin(), maps.material.data.size(), maps.material.data.begin());
  *scale = scene_scale(maps.depth.data, "depth");
  for (float& d : maps.depth.data) d = static_cast<float>(d / *scale);
  return maps;
}

}  // namespace clerestory
