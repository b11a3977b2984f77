#include "tests/experiments/bare_room.hpp"

#include "host/io/datasets.hpp"
#include "tracer/generate.hpp"

namespace clerestory {

std::filesystem::path make_bare_room(const Device& device, const std::filesystem::path& folder, int spp,
                                     std::uint64_t seed) {
  GenerateOptions o;
  o.out = folder, o.rooms.count = 1, o.views.count = 1, o.views.width = 64, o.views.height = 48;
  o.views.spp = spp, o.light.wanted = false, o.rooms.boxes = true, o.rooms.split = "test", o.rooms.seed = seed;
  o.rooms.assets = std::filesystem::path(CLERESTORY_SOURCE_DIR) / "assets";
  generate(device, o);
  return folder / list_rooms(folder, "test").at(0) / "000";
}

}  // namespace clerestory
