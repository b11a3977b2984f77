#include "host/ops/light/ssrt.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "host/graph/replay.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/depth_pyramid.hpp"
#include "host/ops/light/normal_pyramid.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

enum class Origins { Surface, Map, Rays };

constexpr int kLeastGroup = 16;  // work-items of one ray each, where a CPU runs them

void expect(const Value& value, const Shape& shape, const char* what) {
  if (!(value.shape() == shape))
    throw Error(ErrorKind::Failed, fmt::format("{} has another shape", what), "ssrt", value.shape().text(),
                shape.text());
}

// Inputs: pyramid, camera, range, directions, [points, skip], [normal, boxes].
struct SsrtOp : NotDifferentiable, WorthKeeping {
  Shape depth;
  SsrtOptions options;
  Origins origins;
  bool facing;
  SsrtOp(Shape d, const SsrtOptions& o, Origins from, bool f) : depth(d), options(o), origins(from), facing(f) {}

  std::string name() const override { return "ssrt"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[3], 3, "ssrt");
    Shape one = in[3].shape();
    one.c = 1;
    return {{one, Type::Int}, {one, Type::Real}, {one, Type::Real}};
  }

  /// Normals, and the boxes around them, only choose which cells may be hit.
  Slope slope(int input, int) const override {
    const int normal = origins == Origins::Surface ? 4 : 6;
    return facing && (input == normal || input == normal + 1) ? Slope::Detached : Slope::None;
  }

  void launch(Launch& l) const override {
    Defines defines{{"PACKET", std::to_string(lanes(l.device))}};
    if (options.solver == SsrtSolver::Dda) defines["DDA"] = "1";
    if (options.delta == DeltaDepth::Window) defines["WINDOW"] = "1";
    if (options.thickness > 0) defines["THICKNESS"] = "1";
    if (origins == Origins::Map) defines["ORIGIN_MAP"] = "1";
    if (origins == Origins::Rays) defines["ORIGIN_RAYS"] = "1";
    if (facing) defines["FACING"] = "1";
    if (origins == Origins::Surface && !facing) return march(l, defines);
    if (origins == Origins::Surface) return march(l, defines, l.in(4), l.in(5));
    if (!facing) return march(l, defines, l.in(4), l.in(5));
    march(l, defines, l.in(4), l.in(5), l.in(6), l.in(7));
  }

  template <class... More>
  void march(Launch& l, const Defines& defines, const More&... more) const {
    // Rays of a list with origins of their own may be more than the picture has pixels.
    const RayTile t = ray_tile(l, l.in(3).shape, origins == Origins::Rays ? 0x7fffffff : depth.n * depth.plane());
    const PyramidLayout layout = pyramid_layout(depth.w, depth.h);
    const int each = lanes(l.device);
    const long packets = static_cast<long>(t.pixels) * ((t.samples + each - 1) / each);
    const Range range = Range::of(size(packets), each > 1 ? 1 : size(std::max(row_group(l.device), kLeastGroup)));
    l.run_with(defines, "light/ssrt.cl", "ssrt", range, l.in(0), l.in(1), l.in(2), l.in(3), more..., l.out(0), l.out(1),
               l.out(2), t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
               depth.n, depth.w, depth.h, layout.stride, layout.level_rows, layout.levels,
               Launch::Real{options.thickness});
  }

  int lanes(const Device& device) const { return options.lanes > 0 ? options.lanes : ssrt_lanes(device); }

  Cost cost(const Node& node) const override {
    // About 25 steps of 60 operations for a ray at 640 x 480; three numbers in, three out, four bytes a step.
    const double rays = static_cast<double>(node.outputs[0].shape.count());
    return {rays * 25 * 60, rays * (24 + 25 * 4)};
  }
};

}  // namespace

SsrtSolver ssrt_solver_of(const std::string& name) {
  if (name == "dda") return SsrtSolver::Dda;
  if (name == "hierarchical") return SsrtSolver::Hierarchical;
  throw usage_error("no such solver", "ssrt", name, "dda | hierarchical");
}

DeltaDepth delta_depth_of(const std::string& name) {
  if (name == "linear") return DeltaDepth::Linear;
  if (name == "window") return DeltaDepth::Window;
  throw usage_error("no such difference of depths", "delta", name, "linear | window");
}

const char* name_of(DeltaDepth delta) { return delta == DeltaDepth::Linear ? "linear" : "window"; }

int ssrt_lanes(const Device& device) { return row_group(device) == 1 ? 16 : 1; }

SsrtScene ssrt_scene(Value depth, Value normal) {
  return {depth, depth_pyramid(depth), normal, normal ? normal_pyramid(normal) : Value{}};
}

SsrtScene ssrt_scene(std::span<const Value> values) {
  if (values.size() == 2) return {values[0], values[1], {}, {}};
  return {values[0], values[1], values[2], values[3]};
}

std::vector<Value> SsrtScene::values() const {
  return normal ? std::vector{depth, pyramid, normal, boxes} : std::vector{depth, pyramid};
}

SsrtHits ssrt(const SsrtScene& scene, Value camera, Value range, Value directions, const RayOrigins& origins,
              const SsrtOptions& options) {
  const Shape& d = scene.depth.shape();
  const PyramidLayout layout = pyramid_layout(d.w, d.h);
  expect(scene.depth, {d.n, 1, d.h, d.w}, "depth");
  expect(scene.pyramid, {d.n, 1, layout.level_rows, layout.stride}, "the pyramid");
  expect(camera, {d.n, 4, 1, 1}, "the camera");
  expect(range, {d.n, 3, 1, 1}, "the range of depths");
  const bool facing = static_cast<bool>(scene.normal);
  if (facing) expect(scene.normal, {d.n, 3, d.h, d.w}, "the normal map");
  if (facing) expect(scene.boxes, {d.n, 1, layout.level_rows, 2 * layout.stride}, "the normals' pyramid");
  if (static_cast<bool>(origins.points) != static_cast<bool>(origins.skip))
    throw Error(ErrorKind::Failed, "points and pixels to skip come together", "ssrt");
  if (constexpr std::array known{0, 1, 4, 8, 16}; !std::ranges::count(known, options.lanes))
    throw Error(ErrorKind::Failed, "no such number of rays side by side", "ssrt", std::to_string(options.lanes),
                "1, 4, 8, 16, or 0 for the device's");
  if (!(options.thickness >= 0)) throw Error(ErrorKind::Failed, "a negative thickness", "ssrt");

  std::vector<Value> inputs{scene.pyramid, camera, range, directions};
  Origins from = Origins::Surface;
  if (origins.points) {
    from = origins.of_pixels ? Origins::Map : Origins::Rays;
    expect(origins.points, origins.of_pixels ? Shape{d.n, 3, d.h, d.w} : directions.shape(), "the origins");
    Shape one = origins.points.shape();
    one.c = 1;
    expect(origins.skip, one, "pixels to skip");
    if (origins.skip.type() != Type::Int) throw Error(ErrorKind::Failed, "pixels to skip are integers", "ssrt");
    inputs.push_back(origins.points);
    inputs.push_back(origins.skip);
  }
  if (facing) inputs.insert(inputs.end(), {scene.normal, scene.boxes});
  const Value first = scene.depth.graph().make<SsrtOp>(inputs, d, options, from, facing);
  return {first, first.node->value(1), first.node->value(2)};
}

Tensor camera_tensor(std::span<const Camera> cameras) {
  std::vector<double> values;
  for (const Camera& c : cameras) values.insert(values.end(), {c.fx, c.fy, c.cx, c.cy});
  return Tensor(Shape{static_cast<int>(cameras.size()), 4, 1, 1}, std::move(values));
}

Tensor depth_range(const Tensor& depth) {
  Tensor range(Shape{depth.shape.n, 3, 1, 1});
  const long item = depth.shape.item();
  for (int n = 0; n < depth.shape.n; ++n) {
    const std::vector<float> values(depth.real.begin() + n * item, depth.real.begin() + (n + 1) * item);
    double nearest = INFINITY, farthest = 0;
    for (const float z : values)
      if (z > 0 && std::isfinite(z)) nearest = std::min<double>(nearest, z), farthest = std::max<double>(farthest, z);
    range.at(n, 0, 0, 0) = scene_scale(values);
    range.at(n, 1, 0, 0) = nearest;
    range.at(n, 2, 0, 0) = farthest;
  }
  return range;
}

}  // namespace clerestory
