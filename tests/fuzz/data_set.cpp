// A data set of one room with one view and its light, as training, evaluation and `data check` read it.
#include "experiments/evaluation/data_check.hpp"
#include "host/io/datasets.hpp"
#include "host/io/light_files.hpp"
#include "tests/fuzz/folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr int width = 8, height = 6;

void make(const fs::path& folder) {
  RoomView view;
  view.image = Image(width, height, 3, 0.5f), view.albedo = Image(width, height, 3, 0.5f);
  view.mask = Image(width, height, 1, 1.0f), view.depth = Image(width, height, 1, 2.0f);
  view.material = Image(width, height, 3, 0.5f), view.emission = Image(width, height, 3);
  view.normal = Image(width, height, 3);
  std::fill_n(view.normal.plane(2), view.normal.pixels(), 1.0f);
  view.camera = Camera::from_fov(width, height, 60);
  const fs::path room = folder / "room";
  write_view(room, "000", view);
  const EnvmapLayout layout = EnvmapLayout::of(width, height);
  write_envmaps(room, "000", {layout, Image(layout.file_width(), layout.file_height(), 3, 1.0f)});
  write_probes(room, "000", {{{0, 0, -1}, 1, true, Image(probe_width, probe_height, 3, 1.0f)}});
  write_rooms(folder, "train", {"room"});
}

void read(const fs::path& folder) {
  for (const std::string& room : list_rooms(folder, "train"))
    for (const std::string& id : list_views(folder / room)) {
      const RoomView view = read_view(folder / room, id);
      read_envmaps(folder / room, id, view.image.width, view.image.height);
      read_probes(folder / room, id);
      read_gbuffer(folder / room / id);
    }
  check_data(folder, 0);
}

const FuzzTarget target = folder_target("data_set", make, [](const fs::path& folder) {
  try {
    read(folder);
  } catch (const Error&) {
    check_data(folder, 0);  // says what is at fault, and goes on
    throw;
  }
});

}  // namespace
}  // namespace clerestory
