// A scene as inputs of a graph, and how an executor is fed with it.
#pragma once
#include <map>
#include <string>

#include "host/graph/plan.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

/// Inputs "photo", "albedo", "normal", "depth", "material", "camera", "range", "ambient" of one picture.
struct SceneValues {
  SurfaceMaps maps;
  Value photo;    // {1, 3, h, w}
  Value camera;   // {1, 4, 1, 1}
  Value range;    // {1, 3, 1, 1}
  Value ambient;  // {1, 3, 1, 1}
};
SceneValues scene_values(Graph& graph, const Scene& scene);
void feed_scene(Executor& executor, const Scene& scene);
/// "albedo", "normal", "depth", "material" and "camera" alone: what is shaded.
std::map<std::string, Tensor> map_feeds(const Scene& scene);
/// Feeds those; what lights the scene stays.
void feed_maps(Executor& executor, const Scene& scene);

Tensor tensor_of(const Image& image);                // {1, channels, height, width}
Image fetch_image(Executor& executor, Value value);  // and back
/// Runs a graph of constants once: its values as pictures.
std::vector<Image> pictures_by(Device& device, const Graph& graph, const std::vector<Value>& values);

/// `light = image`, which learned light must beat: the photograph's radiance at the hit pixel where the hit is sure,
/// the ambient where it is not (Eq. 6 with a constant in place of the out-of-view light). {1, 3, pixels, samples}.
Value photograph_radiance(Value photo, Value ambient, const SsrtHits& hits);

/// Throws usage_error naming the setting.
RenderSpec render_spec(const RenderSettings& settings);

}  // namespace clerestory
