#include "nets/learned_light.hpp"

#include "host/graph/states_in.hpp"
#include "host/io/resize.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/ask_field.hpp"
#include "host/ops/light/ask_shells.hpp"
#include "host/ops/light/image_light.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "nets/scene_traits.hpp"

namespace clerestory {
namespace {

/// Rays for each answer of the grids from which on these are made. Half of the rays hit something in view.
constexpr double kRaysWorthAnAnswer = 8;

/// A learned light's values of one picture as a flat list, so that they pass through map_chunks.
struct LearnedValues {
  Value photo, range;  // the photograph in the nets' exposure, at its full size
  InViewAnswers near;  // no values: the field answers alone
  LightField field;

  template <class Visit>
  void each(const Visit& visit) {
    visit(photo), visit(range);
    visit(near.grid ? near.normal : near.rows), visit(near.grid);
    for (Value& w : field.weights) visit(w);
    for (Value& b : field.biases) visit(b);
    visit(field.shells), visit(field.background);
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
  Image image, albedo, normal, material, depth;
};

SmallMaps small_maps(const Scene& scene, int longer_side, double exposure) {
  const Size size = net_size(scene.width(), scene.height(), longer_side);
  SmallMaps maps{resize_area(scene.photo, size.width, size.height), resize_area(scene.albedo, size.width, size.height),
                 resize_nearest(scene.normal, size.width, size.height),
                 resize_nearest(scene.material, size.width, size.height),
                 resize_nearest(scene.depth, size.width, size.height)};
  scale(maps.image.data, exposure);
  return maps;
}

/// They as inputs of a graph.
LightInputs inputs_of(Graph& graph, const SmallMaps& small, const Camera& whole, Value range) {
  const auto map = [&](const char* name, int channels) {
    return graph.input(name, {1, channels, small.image.height, small.image.width});
  };
  const Camera camera = whole.resized(small.image.width, small.image.height);
  return {map("light image", 3),
          map("light depth", 1),
          {map("light albedo", 3), map("light normal", 3), map("light material", 3)},
          graph.constant(camera_tensor(std::span(&camera, 1))),
          range};
}

std::function<void(Executor&)> feed_of(const SmallMaps& small) {
  return [small](Executor& executor) {  // what no part reads is passed over
    executor.feed("light image", tensor_of(small.image)), executor.feed("light depth", tensor_of(small.depth));
    executor.feed("light albedo", tensor_of(small.albedo)), executor.feed("light normal", tensor_of(small.normal));
    executor.feed("light material", tensor_of(small.material));
  };
}

/// Asks a picture of no importance, to learn which states there must be.
void check_states(const LightNets& nets, bool in_view) {
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 64, 64), nets.sizes, false)[0];
  ask_light(graph, picture, nets.sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  for (const Value& v : graph.states()) {
    const std::string& name = state_of(v).state_name;
    if (!in_view && name.starts_with("local.")) continue;
    if (!nets.states->has(name)) throw usage_error("the weights of the light lack a tensor", nets.note + ": " + name);
    if (const Shape& stored = nets.states->view(name).shape; !(stored == v.shape()))
      throw usage_error("a tensor has another shape than the light's net", nets.note + ": " + name, stored.text(),
                        v.shape().text());
  }
}

Value ask_far_light(const LightField& field, Value points, Value direction, Value range, const RayList& list,
                    const OutOfViewSize& size) {
  if (size.form == OutOfViewForm::Field)
    return ask_field(field.weights, field.biases, points, direction, range, list,
                     {size.march, size.octaves, size.released_output}, field.background);
  return ask_shells(field.shells, points, direction, range, list, shell_radii(size.shells));
}

/// Radiance from out of view; 0 for rays that `list` leaves out.
Value far_light(const LightField& field, Value points, Value direction, Value range, const RayList& list,
                const OutOfViewSize& size) {
  return with_gain(ask_far_light(field, points, direction, range, list, size), size);
}

}  // namespace

std::string why_none_are_shared(const Scene& scene, const RenderSettings& settings, double rays) {
  const bool scene_decides = settings.light == "net" && settings.nets && settings.sharing == Sharing::WhereItPays &&
                             settings.leave_out.contains(Saving::SharedAnswers);
  if (!scene_decides) return {};
  const Size size = net_size(scene.width(), scene.height(), settings.nets->longer_side);
  const double to_share = rays / (size.width * size.height * kGridSide * kGridSide);
  if (!(to_share > kRaysWorthAnAnswer))
    return fmt::format("{:.1f} rays for each answer, which pay from {:g} on", to_share, kRaysWorthAnAnswer);
  if (const double mirrors = mirrors_of(scene); mirrors > kMostMirrors)
    return fmt::format("{:.1f} % of the surfaces are mirrors, in which answers between others show", 100 * mirrors);
  return {};
}

bool shares_answers(const Scene& scene, const RenderSettings& settings, double rays) {
  if (settings.light != "net" || !settings.nets) return false;
  if (settings.sharing != Sharing::WhereItPays) return settings.sharing == Sharing::Always;
  return settings.leave_out.contains(Saving::SharedAnswers) && why_none_are_shared(scene, settings, rays).empty();
}

SceneLight learned_light(Graph& graph, const SceneValues& v, const Scene& scene, const RenderSettings& settings,
                         double rays_to_come) {
  const LightNets& nets = *settings.nets;
  const bool in_view = settings.light == "net", mixes = mixes_by_hits(settings.light);
  check_states(nets, in_view);
  const double exposure = exposure_of(scene.photo.data);
  const SmallMaps small = small_maps(scene, nets.longer_side, exposure);
  const LightInputs picture = inputs_of(graph, small, scene.camera, v.range);
  LightSizes sizes = nets.sizes;
  sizes.out_of_view.march.jitter = false;  // the middle of each piece: no noise, and the same whatever the chunks

  LearnedValues values;
  values.photo = scale(v.photo, exposure);
  values.range = v.range;
  if (in_view) {
    const LightPixels pixels = light_pixels({graph, false, "local"}, picture.image, picture.surfaces, sizes.in_view);
    const bool share = shares_answers(scene, settings, rays_to_come);
    values.near =
        in_view_answers({graph, false, "local"}, pixels, sizes.in_view, share ? picture.surfaces.normal : Value{});
  }
  values.field = light_fields({graph, false, "global"}, picture, sizes.out_of_view)[0];

  SceneLight light;
  light.inputs = values.list();
  light.traces = mixes;
  if (values.near.grid) light.shared_answers = static_cast<double>(values.near.grid.shape().plane());
  light.states = in_precision(nets.states, settings.precision);
  // To look an answer up costs no more than to list who looks. All else is listed, for a tile may have fewer rays than
  // it has room for.
  const bool lists = !values.near.grid, saves = settings.leave_out.contains(Saving::SmallShares);
  light.radiance = [values, sizes, in_view, mixes, exposure, lists, saves](
                       const AskedRays& rays, std::span<const Value> in, RayCounts* counts) {
    const LearnedValues here = values.inside(in);
    const Value direction = rays.direction;
    const auto listed = [&](const char* name, LightPart part) {
      if (!lists) return RayList{};
      const RayList list = select_rays(rays.hits.u, rays.hits.pixel, direction, part, saves ? kLeastShare : kEveryRay);
      if (counts && saves) counts->emplace_back(name, list.count);
      return list;
    };
    const RayList uncertain = mixes ? listed("out of view", LightPart::OutOfView) : RayList{};
    const Value far = far_light(here.field, rays.points, direction, here.range, uncertain, sizes.out_of_view);
    if (!mixes) return scale(far, 1 / exposure);
    const Value near =
        in_view ? ask_in_view_light({direction.graph(), false, "local"}, here.near, rays.hits.pixel, direction,
                                    here.photo, listed("in view", LightPart::InView), sizes.in_view)
                : image_light(here.photo, direction.graph().fill({1, 3, 1, 1}, 0), rays.hits.pixel);
    return scale(mix_light(near, far, rays.hits.u), 1 / exposure);
  };
  light.feed = feed_of(small);
  return light;
}

SceneLight li2020_scene_light(Graph& graph, const Scene& scene, const SceneValues& v, const RenderSettings& settings) {
  const LightNets& nets = *settings.nets;
  check_states(nets, true);
  const double exposure = exposure_of(scene.photo.data);
  const SmallMaps small = small_maps(scene, nets.longer_side, exposure);
  const Gaussians lobes =
      lit_pictures(graph, inputs_of(graph, small, scene.camera, v.range), nets.sizes, false)[0].lobes;
  SceneLight light;
  light.inputs = {lobes.axis, lobes.sharpness, scale(lobes.weight, 1 / exposure)};
  light.states = in_precision(nets.states, settings.precision);
  const Shape picture{1, 3, scene.height(), scene.width()};  // which rays.camera is of
  light.radiance = [picture](const AskedRays& rays, std::span<const Value> in, RayCounts*) {
    return gaussians_of_points({in[0], in[1], in[2]}, rays.camera, picture, rays.points, rays.direction);
  };
  light.feed = feed_of(small);
  return light;
}

}  // namespace clerestory
