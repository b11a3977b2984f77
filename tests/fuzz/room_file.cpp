// Descriptions of rooms. An input is the columns of a file, not yet packed.
#include "tracer/room_file.hpp"

#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"
#include "tracer/column_file.hpp"

namespace clerestory {
namespace {

const FuzzTarget target("room_file", "packed.rooms", [](const std::filesystem::path& file) {
  write_file(file, packed_columns(read_file(file, 1 << 20, true)));
  write_room_file(file, read_room_file(file));
});

}  // namespace
}  // namespace clerestory
