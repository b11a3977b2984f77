#include "tests/experiments/bare_room.hpp"

#include "host/io/datasets.hpp"
#include "tracer/generate.hpp"

namespace clerestory {

std::filesystem::path make_bare_room(const Device& device, const std::filesystem::path& folder, int spp,
                                     std::uint64_t seed) {
  GenerateOptions o;
  o.out = folder, o.rooms = 1, o.views = 1, o.width = 64, o.height = 48;
  o.spp = spp, o.light = false, o.box_rooms = true, o.split = "test", o.seed = seed;
  o.assets = std::filesystem::path(CLERESTORY_SOURCE_DIR) / "assets";
  generate(device, o);
  return folder / list_rooms(folder, "test").at(0) / "000";
}

}  // namespace clerestory
