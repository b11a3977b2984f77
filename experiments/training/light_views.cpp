#include "experiments/training/light_views.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

std::uint64_t bytes_of(const LightView& v) {
  std::uint64_t floats = v.envmaps.radiance.data.size();
  for (const Image* image :
       {&v.image, &v.albedo, &v.normal, &v.depth, &v.material, &v.true_normal, &v.true_depth, &v.emission})
    floats += image->data.size();
  for (const Probe& p : v.probes) floats += p.radiance.data.size();
  return sizeof(float) * floats;
}

Image flags_of(const std::optional<Image>& emission, int width, int height) {
  Image flags(width, height, 1);
  if (!emission) return flags;
  for (std::size_t i = 0; i < flags.data.size(); ++i)
    for (int c = 0; c < 3; ++c)
      if (emission->plane(c)[i] > 0) flags.data[i] = 1;
  return flags;
}

double factor_of(DepthUnit unit, const LightView& view, const Image& depth) {
  return unit == DepthUnit::True ? metres_of(view, depth) : 1;
}

/// Whether rays can be drawn: from a tile at a pixel with depth, or from a probe.
bool says_something(const LightView& view) {
  const EnvmapLayout& layout = view.envmaps.layout;
  bool any = !view.probes.empty();
  for (int tile = 0; tile < layout.tiles() && !any; ++tile)
    any = view.depth.at(0, layout.pixel_y(tile / layout.columns), layout.pixel_x(tile % layout.columns)) > 0;
  return any;
}

}  // namespace

LightView read_light_view(const ViewName& name, int width, int height) {
  RoomView room = read_view(name.room, name.id);
  if (room.image.width != width || room.image.height != height)
    throw usage_error("a view of another size than the light is trained at", name.text(),
                      fmt::format("{}x{}", room.image.width, room.image.height), fmt::format("{}x{}", width, height));
  if (!room.camera)
    throw usage_error("a view without a camera", view_file(name.room, name.id, "camera", "json").string());
  if (std::none_of(room.depth.data.begin(), room.depth.data.end(), [](float z) { return z > 0; }))
    throw usage_error("no pixel of the view has depth", name.text());
  LightView view;
  view.envmaps = read_envmaps(name.room, name.id, width, height);
  view.probes = read_probes(name.room, name.id);
  view.emission = flags_of(room.emission, width, height);
  view.camera = *room.camera;
  view.image = std::move(room.image), view.albedo = std::move(room.albedo), view.normal = std::move(room.normal);
  view.depth = std::move(room.depth), view.material = std::move(room.material);
  std::ranges::copy(view.emission.data, view.material.plane(2));
  view.true_normal = view.normal, view.true_depth = view.depth;
  if (!says_something(view)) throw usage_error("no tile of the view has depth, and it has no probe", name.text());
  return view;
}

void see_predicted(LightView& view, const MapSet& maps, double metres) {
  const std::size_t n = view.image.pixels();
  view.albedo = maps.albedo, view.normal = maps.normal, view.depth = maps.depth;
  std::copy_n(maps.material.data.begin(), 2 * n, view.material.data.begin());
  for (float& z : view.depth.data) z = static_cast<float>(z * metres);
}

double metres_of(const LightView& view, const Image& depth) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < depth.data.size(); ++i)
    if (view.true_depth.data[i] > 0 && depth.data[i] > 0)
      ratios.push_back(static_cast<double>(view.true_depth.data[i]) / static_cast<double>(depth.data[i]));
  return ratios.empty() ? 1 : median(ratios);
}

LightStore::LightStore(std::vector<ViewName> names, int width, int height, std::uint64_t cache_bytes)
    : names_(std::move(names)), width_(width), height_(height), cache_bytes_(cache_bytes), cache_(names_.size()) {}

std::shared_ptr<const LightView> LightStore::get(std::size_t i) {
  {
    const std::lock_guard lock(mutex_);
    if (cache_.at(i)) return cache_[i];
  }
  LightView read = read_light_view(names_[i], width_, height_);
  if (!predicted_.empty()) see_predicted(read, predicted_[i], factor_of(unit_, read, predicted_[i].depth));
  const auto view = std::make_shared<const LightView>(std::move(read));
  const std::uint64_t bytes = bytes_of(*view);
  const std::lock_guard lock(mutex_);
  if (!cache_[i] && used_ + bytes <= cache_bytes_) used_ += bytes, cache_[i] = view;
  return view;
}

void LightStore::predict(const std::function<MapSet(const Image&)>& predict, DepthUnit unit) {
  std::vector<MapSet> maps;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const std::shared_ptr<const LightView> view = get(i);
    MapSet predicted = predict(view->image);
    const std::lock_guard lock(mutex_);
    if (cache_[i]) {
      LightView seen = *view;
      see_predicted(seen, predicted, factor_of(unit, seen, predicted.depth));
      cache_[i] = std::make_shared<const LightView>(std::move(seen));
      predicted = {};  // a cached view stays, with its maps in it
    }
    maps.push_back(std::move(predicted));
  }
  const std::lock_guard lock(mutex_);
  predicted_ = std::move(maps), unit_ = unit;
}

}  // namespace clerestory
