#include "experiments/evaluation/layouts.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>

#include "experiments/evaluation/whdr.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/light_files.hpp"
#include "host/io/nyu.hpp"
#include "host/io/openrooms.hpp"
#include "host/report/staged_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct ListedView {
  std::string split, room, id;
};

std::vector<ListedView> views_of(const fs::path& rooms) {
  std::vector<ListedView> views;
  for (const char* split : {"train", "val", "test"}) {
    if (!fs::exists(rooms / fmt::format("{}.txt", split))) continue;
    for (const std::string& room : list_rooms(rooms, split))
      for (const std::string& id : list_views(rooms / room)) views.push_back({split, room, id});
  }
  if (views.empty()) throw usage_error("there is no view", rooms.string());
  return views;
}

bool emits(const RoomView& view, std::size_t pixel) {
  for (int c = 0; view.emission && c < 3; ++c)
    if (view.emission->plane(c)[pixel] > 0) return true;
  return false;
}

/// Pictures of the list's order into a folder.
class Writer {
 public:
  virtual ~Writer() = default;
  virtual void put(const ListedView& listed, const RoomView& view) = 0;
  virtual void finish() {}
};

class IiwWriter : public Writer {
 public:
  explicit IiwWriter(fs::path folder) : folder_(std::move(folder)) {}
  void put(const ListedView& listed, const RoomView& view) override {
    const std::string id = listed.room + "_" + listed.id;
    Image usable = view.mask;
    for (std::size_t i = 0; i < usable.data.size(); ++i)
      if (emits(view, i)) usable.data[i] = 0;
    const Judgements judgements = judgements_of(view.albedo, usable, content_hash(id));
    if (judgements.points.empty()) return;  // a file without points is none
    write_png(folder_ / (id + ".png"), view.image);
    write_judgements(folder_ / (id + ".json"), judgements);
  }

 private:
  fs::path folder_;
};

class NyuSetWriter : public Writer {
 public:
  NyuSetWriter(fs::path folder, int count) : folder_(std::move(folder)), count_(count) {}
  void put(const ListedView& listed, const RoomView& view) override {
    if (!file_) file_ = std::make_unique<NyuWriter>(folder_ / kNyuFile, count_, view.image.width, view.image.height);
    file_->put(++number_, display_coded(view.image), view.depth);
    write_nyu_normals(folder_, number_, {view.normal, view.mask});
    lists_[listed.split] += nyu_name(number_) + ".png\n";
  }
  void finish() override {
    file_->commit();
    for (const auto& [split, text] : lists_) write_file(folder_ / (split + ".txt"), text);
  }

 private:
  fs::path folder_;
  int count_, number_ = 0;
  std::unique_ptr<NyuWriter> file_;  // made when the first view tells its size
  std::map<std::string, std::string> lists_;
};

/// Tiles for every fourth pixel: each takes those of the nearest point.
Image tiles_of(const Envmaps& light, int width, int height) {
  const int columns = width / openrooms_stride, rows = height / openrooms_stride;
  Image out(columns * openrooms_azimuths, rows * openrooms_elevations, 3);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const int column = (2 * (x / openrooms_azimuths) + 1) * light.layout.columns / (2 * columns),
                row = (2 * (y / openrooms_elevations) + 1) * light.layout.rows / (2 * rows);
      const auto radiance = light.at(column, row, x % openrooms_azimuths / 2, y % openrooms_elevations / 2);
      for (int c = 0; c < 3; ++c) out.at(c, y, x) = radiance[static_cast<std::size_t>(c)];
    }
  return out;
}

class OpenRoomsWriter : public Writer {
 public:
  OpenRoomsWriter(fs::path rooms, fs::path folder) : rooms_(std::move(rooms)), folder_(std::move(folder)) {}
  void put(const ListedView& listed, const RoomView& view) override {
    OpenRoomsView out{view.image, view.albedo, view.normal, Image(view.mask.width, view.mask.height, 1),
                      view.depth, view.mask,   {}};
    std::copy_n(view.material.plane(0), out.roughness.data.size(), out.roughness.data.begin());
    for (std::size_t i = 0; i < out.mask.data.size(); ++i)
      if (out.mask.data[i] > 0.5f && emits(view, i)) out.mask.data[i] = 0.5f;
    if (fs::exists(view_file(rooms_ / listed.room, listed.id, "envmap")))
      out.light = tiles_of(read_envmaps(rooms_ / listed.room, listed.id, view.image.width, view.image.height),
                           view.image.width, view.image.height);
    if (listed.id.empty() || listed.id.size() > 6 || listed.id.find_first_not_of("0123456789") != std::string::npos)
      throw usage_error("OpenRooms numbers its views", (rooms_ / listed.room).string(), listed.id,
                        "views 000, 001, ...");
    write_openrooms({folder_, "main_xml", listed.room, std::stoi(listed.id) + 1}, out);
    std::vector<std::string>& list = lists_[listed.split];
    if (list.empty() || list.back() != listed.room) list.push_back(listed.room);
  }
  void finish() override {
    for (const auto& [split, scenes] : lists_) write_rooms(folder_, split, scenes);
  }

 private:
  fs::path rooms_, folder_;
  std::map<std::string, std::vector<std::string>> lists_;
};

std::unique_ptr<Writer> writer_of(const std::string& layout, const fs::path& rooms, const fs::path& folder, int count) {
  if (layout == "iiw") return std::make_unique<IiwWriter>(folder);
  if (layout == "nyu") return std::make_unique<NyuSetWriter>(folder, count);
  return std::make_unique<OpenRoomsWriter>(rooms, folder);
}

/// A usable pixel of the cell [x0, x1) x [y0, y1), drawn; nothing where none of so many draws is one.
std::optional<JudgedPoint> drawn_point(const Image& usable, int x0, int x1, int y0, int y1, std::mt19937_64& random) {
  for (int draw = 0; draw < 16; ++draw) {
    const int x = x0 + static_cast<int>(random() % static_cast<unsigned>(x1 - x0)),
              y = y0 + static_cast<int>(random() % static_cast<unsigned>(y1 - y0));
    if (usable.at(0, y, x) > 0.5f) return JudgedPoint{0, (x + 0.5) / usable.width, (y + 0.5) / usable.height, true};
  }
  return std::nullopt;
}

}  // namespace

Judgements judgements_of(const Image& albedo, const Image& usable, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const int cell = std::max(1, std::max(albedo.width, albedo.height) / 10), columns = (albedo.width + cell - 1) / cell,
            rows = (albedo.height + cell - 1) / cell;
  const Image shown = display_coded(albedo);
  Judgements all;
  std::map<std::pair<int, int>, std::size_t> places;
  const auto compare = [&](std::size_t first, std::size_t second) {
    const JudgedPoint &one = all.points[first], &two = all.points[second];
    const Darker linear = darker_of(albedo, one, two);
    if (darker_of(shown, one, two) == linear)
      all.comparisons.push_back({first, second, linear, 1});
    else
      all.comparisons.push_back({first, second, std::nullopt, 0});
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      auto point = drawn_point(usable, column * cell, std::min(albedo.width, (column + 1) * cell), row * cell,
                               std::min(albedo.height, (row + 1) * cell), random);
      if (!point) continue;
      const std::size_t here = all.points.size();
      point->id = static_cast<std::int64_t>(here) + 1;
      all.points.push_back(*point);
      places[{row, column}] = here;
      for (const auto& before : {std::pair{row, column - 1}, std::pair{row - 1, column}})
        if (const auto found = places.find(before); found != places.end()) compare(found->second, here);
    }
  return all;
}

void check_layout_is_new(const fs::path& rooms, const std::string& layout) {
  std::error_code none;
  if (fs::exists(rooms / layout) && !fs::is_empty(rooms / layout, none))
    throw usage_error("is there already", (rooms / layout).string(), {}, "a new folder: remove it to write it again");
}

void write_layout(const fs::path& rooms, const std::string& layout, const std::function<void(int, int)>& progress) {
  check_layout_is_new(rooms, layout);
  const std::vector<ListedView> views = views_of(rooms);
  const int total = static_cast<int>(views.size());
  StagedFolder folder(rooms / layout);
  const auto writer = writer_of(layout, rooms, folder.path(), total);
  for (int done = 0; done < total; ++done) {
    const ListedView& listed = views[static_cast<std::size_t>(done)];
    writer->put(listed, read_view(rooms / listed.room, listed.id));
    if (progress) progress(done + 1, total);
  }
  writer->finish();
  folder.commit();
}

}  // namespace clerestory
