// A view of OpenRooms with its light, and the list that names it.
#include "host/io/openrooms.hpp"

#include "host/io/files.hpp"
#include "tests/fuzz/folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr int width = 8, height = 4;

void make(const fs::path& folder) {
  OpenRoomsView view;
  view.image = Image(width, height, 3, 0.5f), view.albedo = Image(width, height, 3, 0.5f);
  view.normal = Image(width, height, 3, 0.6f), view.roughness = Image(width, height, 1, 0.5f);
  view.depth = Image(width, height, 1, 2.0f), view.mask = Image(width, height, 1, 1.0f);
  view.light = Image(64, 16, 3, 1.0f);
  write_openrooms({folder, "main_xml", "scene", 1}, view);
  write_file(folder / "test.txt", "scene\n");
}

const FuzzTarget target = folder_target("openrooms", make, [](const fs::path& folder) {
  for (const OpenRoomsName& name : list_openrooms(folder, "test")) read_openrooms(name);
});

}  // namespace
}  // namespace clerestory
