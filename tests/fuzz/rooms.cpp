// The list of rooms of a data set that has one, named room.
#include "host/io/datasets.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("rooms", "train.txt", [](const std::filesystem::path& file) {
  std::filesystem::create_directories(file.parent_path() / "room");
  list_rooms(file.parent_path(), "train");
});

}  // namespace clerestory
