#include "experiments/training/view_store.hpp"

#include <half.h>

#include <algorithm>

#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {

namespace {

void add_views(std::vector<ViewName>& views, const std::filesystem::path& root, const std::string& split) {
  for (const std::string& room : list_rooms(root, split))
    for (const std::string& id : list_views(root / room)) views.push_back({root / room, id});
}

}  // namespace

std::vector<ViewName> name_views(const std::vector<std::string>& roots, const std::string& split) {
  std::vector<ViewName> views;
  for (const std::string& root : roots) add_views(views, root, split);
  if (views.empty())
    throw usage_error("there is no view", roots.empty() ? "data" : fmt::format("{}", fmt::join(roots, ", ")),
                      "no room of " + split + ".txt holds one", "rooms written by `clerestory generate`");
  return views;
}

std::vector<ViewName> all_views(const std::filesystem::path& root) {
  std::vector<ViewName> views;
  for (const char* split : {"train", "val", "test"})
    if (std::filesystem::exists(root / fmt::format("{}.txt", split))) add_views(views, root, split);
  if (views.empty())
    throw usage_error("there is no view", root.string(), "no room of train.txt, val.txt or test.txt holds one",
                      "rooms written by `clerestory generate`");
  return views;
}

std::uint64_t views_hash(const std::vector<ViewName>& views) {
  std::uint64_t hash = content_hash("views");
  for (const ViewName& view : views)  // not the root: a data set may move
    hash = content_hash(view.room.filename().string() + "/" + view.id + "\n", hash);
  return hash;
}

ViewStore::ViewStore(std::vector<ViewName> names, int width, int height, std::uint64_t cache_bytes)
    : names_(std::move(names)), width_(width), height_(height), cache_bytes_(cache_bytes), cache_(names_.size()) {}

PreparedView ViewStore::get(std::size_t i) {
  {
    const std::lock_guard lock(mutex_);
    if (!cache_.at(i).values.empty()) return unpack(cache_[i]);
  }
  Packed packed = pack(prepare_view(read_view(names_[i].room, names_[i].id), width_, height_));
  PreparedView view = unpack(packed);
  const std::lock_guard lock(mutex_);
  if (cache_[i].values.empty() && used_ + packed.bytes() <= cache_bytes_) {
    used_ += packed.bytes();
    cache_[i] = std::move(packed);
  }
  return view;
}

ViewStore::Packed ViewStore::pack(const PreparedView& view) {
  Packed packed;
  packed.scene_scale = view.scene_scale, packed.camera = view.camera;
  for (const Image* map :
       {&view.image, &view.truth.albedo, &view.truth.normal, &view.truth.depth, &view.truth.material})
    for (const float value : map->data) packed.values.push_back(half(std::clamp(value, -65504.0f, 65504.0f)).bits());
  for (std::size_t i = 0; i < view.masks.geometry.data.size(); ++i)
    packed.masks.push_back(static_cast<std::uint8_t>((view.masks.geometry.data[i] > 0.5f ? 1 : 0) |
                                                     (view.masks.albedo.data[i] > 0.5f ? 2 : 0) |
                                                     (view.masks.material.data[i] > 0.5f ? 4 : 0)));
  return packed;
}

PreparedView ViewStore::unpack(const Packed& packed) const {
  PreparedView view;
  view.scene_scale = packed.scene_scale, view.camera = packed.camera;
  view.image = Image(width_, height_, 3);
  view.truth = {Image(width_, height_, 3), Image(width_, height_, 3), Image(width_, height_, 1),
                Image(width_, height_, 2)};
  view.masks = {Image(width_, height_, 1), Image(width_, height_, 1), Image(width_, height_, 1)};
  auto from = packed.values.begin();
  for (Image* map : {&view.image, &view.truth.albedo, &view.truth.normal, &view.truth.depth, &view.truth.material})
    for (float& value : map->data) {
      half h;
      h.setBits(*from++);
      value = h;
    }
  for (std::size_t i = 0; i < packed.masks.size(); ++i) {
    view.masks.geometry.data[i] = packed.masks[i] & 1 ? 1 : 0;
    view.masks.albedo.data[i] = packed.masks[i] & 2 ? 1 : 0;
    view.masks.material.data[i] = packed.masks[i] & 4 ? 1 : 0;
  }
  return view;
}

}  // namespace clerestory
