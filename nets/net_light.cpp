#include "nets/net_light.hpp"

#include <bit>

#include "host/io/resize.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reshape.hpp"

namespace clerestory {
namespace {

constexpr double kIntermediates = 512.0 * (1 << 20);  // bytes

/// A learned light's values of one picture as a flat list, so that they pass through map_chunks.
struct LearnedValues {
  Value photo, range;  // the photograph in the nets' exposure, at its full size
  LightPixels pixels;  // no values: the field answers alone
  LightField field;

  template <class Visit>
  void each(const Visit& visit) {
    visit(photo), visit(range), visit(pixels.features), visit(pixels.surface);
    for (Value& w : field.weights) visit(w);
    for (Value& b : field.biases) visit(b);
    visit(field.shells);
  }
  std::vector<Value> list() {
    std::vector<Value> values;
    each([&](const Value& v) {
      if (v) values.push_back(v);
    });
    return values;
  }
  /// The same values as a body sees them.
  LearnedValues inside(std::span<const Value> in) const {
    LearnedValues inner = *this;
    std::size_t at = 0;
    inner.each([&](Value& v) {
      if (v) v = in[at++];
    });
    return inner;
  }
};

/// The maps that the nets read: small, and the photograph as bright as in training.
struct SmallMaps {
  Image image, albedo, normal, material;
};

SmallMaps small_maps(const Scene& scene, int longer_side, double exposure) {
  const Size size = net_size(scene.width(), scene.height(), longer_side);
  SmallMaps maps{resize_area(scene.photo, size.width, size.height), resize_area(scene.albedo, size.width, size.height),
                 resize_nearest(scene.normal, size.width, size.height),
                 resize_nearest(scene.material, size.width, size.height)};
  for (float& v : maps.image.data) v = static_cast<float>(v * exposure);
  return maps;
}

/// Points for every ray of a tile: {1, 3, P, 1} repeated along the samples.
Value point_of_each_ray(Value points, const Shape& rays) {
  if (points.shape() == rays) return points;
  const Value column = reshape(points, {3 * rays.h, 1, 1, 1});
  return reshape(expand(column, {3 * rays.h, 1, 1, rays.w}), rays);
}

/// Asks a picture of no importance, to learn which states there must be.
void check_states(const LightNets& nets, bool in_view) {
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, lit_inputs(graph, 1, 32, 32), nets.sizes, false)[0];
  ask_light(graph, picture, nets.sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  for (const Value& v : graph.states()) {
    const std::string& name = static_cast<const StateOp&>(*v.node->op).state_name;
    if (!in_view && name.starts_with("local.")) continue;
    if (!nets.states->has(name)) throw usage_error("the weights of the light lack a tensor", nets.note + ": " + name);
    if (const Shape& stored = nets.states->view(name).shape; !(stored == v.shape()))
      throw usage_error("a tensor has another shape than the light's net", nets.note + ": " + name, stored.text(),
                        v.shape().text());
  }
}

}  // namespace

int learned_chunk_rays(const LightSizes& sizes, bool in_view) {
  const OutOfViewSize& o = sizes.out_of_view;
  int widest = 4;
  for (const int width : o.hidden) widest = std::max(widest, width);
  double floats = o.march.segments * (3.0 + 3 + 6 * o.octaves + 2 * widest);
  if (in_view) floats += 4.0 * sizes.in_view.width + 2.0 * sizes.in_view.frequencies;
  return static_cast<int>(std::bit_floor(static_cast<unsigned>(kIntermediates / (4 * floats))));
}

SceneLight net_light(Graph& graph, const SceneValues& v, const Scene& scene, const LightNets& nets, bool in_view) {
  check_states(nets, in_view);
  const double exposure = exposure_of(scene.photo.data);
  const SmallMaps small = small_maps(scene, nets.longer_side, exposure);
  LightSizes sizes = nets.sizes;
  sizes.out_of_view.march.jitter = false;  // the middle of each piece: no noise, and the same whatever the chunks

  const auto map = [&](const char* name) { return graph.input(name, {1, 3, small.image.height, small.image.width}); };
  const Value image = map("light image");
  LearnedValues values;
  values.photo = scale(v.photo, exposure);
  values.range = v.range;
  if (in_view)
    values.pixels = light_pixels({graph, false, "local"}, image,
                                 {map("light albedo"), map("light normal"), map("light material")}, sizes.in_view);
  const Camera camera = scene.camera.resized(small.image.width, small.image.height);
  values.field = light_fields({graph, false, "global"}, image, graph.constant(camera_tensor(std::span(&camera, 1))),
                              sizes.out_of_view)[0];

  SceneLight light;
  light.inputs = values.list();
  light.traces = in_view;
  light.chunk_rays = learned_chunk_rays(sizes, in_view);
  light.states = nets.states;
  light.radiance = [values, sizes, in_view, exposure](const AskedRays& rays, std::span<const Value> in, RayCounts*) {
    const LearnedValues here = values.inside(in);
    const Value points = point_of_each_ray(rays.points, rays.direction.shape());
    Value radiance = out_of_view_light(here.field, points, rays.direction, here.range, sizes.out_of_view);
    if (in_view) {
      const Value near = in_view_light({points.graph(), false, "local"}, here.pixels, rays.hits.pixel, rays.direction,
                                       here.photo, sizes.in_view);
      radiance = mix_light(near, radiance, rays.hits.u);
    }
    return scale(radiance, 1 / exposure);
  };
  light.feed = [small, in_view](Executor& executor) {
    executor.feed("light image", tensor_of(small.image));
    if (!in_view) return;
    executor.feed("light albedo", tensor_of(small.albedo));
    executor.feed("light normal", tensor_of(small.normal));
    executor.feed("light material", tensor_of(small.material));
  };
  return light;
}

}  // namespace clerestory
