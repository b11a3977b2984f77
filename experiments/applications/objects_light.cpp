#include "experiments/applications/objects_light.hpp"

#include "host/ops/shade/bounce.hpp"
#include "host/ops/shade/nearer.hpp"

namespace clerestory {
namespace {

constexpr float kRayOffset = 1e-3f;  // metres: a ray that starts on an object must leave it first

/// Asks the tracer which rays hit an object: distance, point, normal, object.
struct MeetObjectsOp : NotDifferentiable {
  std::shared_ptr<TraceObjects> objects;
  bool of_pixels;
  MeetObjectsOp(std::shared_ptr<TraceObjects> o, bool p) : objects(std::move(o)), of_pixels(p) {}
  std::string name() const override { return "meet_objects"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    const Shape& rays = in[1].shape();
    const Shape one{1, 1, rays.h, rays.w};
    return {{one}, {rays}, {rays}, {one, Type::Int}};
  }
  void launch(Launch& l) const override {
    if (l.precision == Precision::Double)
      throw Error(ErrorKind::Failed, "objects are traced in single precision", name());
    const Shape &rays = l.in(1).shape, &points = l.in(0).shape;
    const auto memory = [](const TensorView& v) { return TraceObjects::Memory{v.buffer, v.offset, v.stride}; };
    objects->meet({memory(l.in(0)), memory(l.in(1)), of_pixels, static_cast<int>(points.plane()), l.chunk.first_pixel,
                   l.chunk.pixels, l.chunk.first_sample, l.chunk.samples, rays.h, rays.w},
                  {memory(l.out(0)), memory(l.out(1)), memory(l.out(2)), memory(l.out(3))}, kRayOffset);
  }
};

struct ObjectHits {
  Value distance, point, normal, object;
};

ObjectHits meet(const std::shared_ptr<TraceObjects>& objects, Value points, Value directions, bool of_pixels) {
  const Value first = directions.graph().make<MeetObjectsOp>({points, directions}, objects, of_pixels);
  return {first, first.node->value(1), first.node->value(2), first.node->value(3)};
}

/// What the light of one chunk needs, by name.
struct Chunked {
  std::shared_ptr<TraceObjects> objects;
  const SceneLight& light;
  std::span<const Value> light_inputs;
  SsrtOptions options;
  ObjectsLightInputs in;
  Value camera;
  RayCounts* counts;
  Value nowhere;  // Int, one per ray, -1: rays from objects skip no cell
  int bounces;

  /// The first rays start at pixels, all others where the one before met an object.
  static bool of_pixels(int number) { return number == 1; }

  /// What the scene sends along rays from `points`, and where they hit it.
  struct OfScene {
    SsrtHits seen;
    Value radiance;
  };
  OfScene of_scene(Value points, Value skip, Value direction, const Lobes& lobes, int number) const {
    const SsrtHits seen = ssrt(in.scene, camera, in.range, direction, {points, skip, of_pixels(number)}, options);
    const Value starts = of_pixels(number) ? points_of_chunk(points, direction) : points;
    return {seen, light.radiance({starts, direction, lobes, seen, camera}, light_inputs, counts)};
  }

  /// Radiance along rays from `points`: those of pixels that show the scene where `shows` is given, else of objects.
  Value radiance(Value points, Value skip, Value direction, const Lobes& lobes, int number, Value shows) const {
    if (number > bounces) return of_scene(points, skip, direction, lobes, number).radiance;
    const ObjectHits met = meet(objects, points, direction, of_pixels(number));
    const OfScene scene =
        of_scene(points, skip, shows ? needed_rays(direction, met.object, shows) : direction, lobes, number);
    const Bounce next = bounce(direction, met.normal, met.object, in.materials, lobes, number);
    const Value beyond = radiance(met.point, nowhere, next.direction, next.lobes, number + 1, {});
    return nearer({points, direction, scene.seen.pixel, met.object, met.distance, of_pixels(number)}, scene.radiance,
                  next.weight, beyond, in.scene.depth, camera, shows);
  }
};

constexpr std::size_t kOwnInputs = 9;

}  // namespace

std::vector<Value> inputs_of(const ObjectsLightInputs& in, const SceneLight& light) {
  std::vector<Value> list = in.scene.values();
  list.insert(list.end(), {in.range, in.points, in.skip, in.shows, in.materials});
  list.insert(list.end(), light.inputs.begin(), light.inputs.end());
  return list;
}

LightBuilder objects_light(std::shared_ptr<TraceObjects> objects, const SceneLight& light,
                           const SsrtOptions& ssrt_options, int bounces) {
  return [=](Graph& inner, const RayBatch& rays, std::span<const Value> v) {
    const ObjectsLightInputs in{ssrt_scene(v.first(4)), v[4], v[5], v[6], v[7], v[8]};
    const Shape one{1, 1, rays.direction.shape().h, rays.direction.shape().w};
    const Value nowhere =
        inner.constant(Tensor::of_int(one, std::vector<int>(static_cast<std::size_t>(one.count()), -1)));
    const Chunked chunk{objects, light,  v.subspan(kOwnInputs), ssrt_options, in, rays.camera, rays.counts,
                        nowhere, bounces};
    return chunk.radiance(in.points, in.skip, rays.direction, rays.lobes, 1, in.shows);
  };
}

}  // namespace clerestory
