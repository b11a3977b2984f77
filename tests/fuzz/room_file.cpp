// Descriptions of rooms, under the hash that belongs to them.
#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"
#include "tracer/room_file.hpp"

namespace clerestory {

static const FuzzTarget target("room_file", "rooms.h5", [](const std::filesystem::path& file) {
  const std::string bytes = read_file(file, 1 << 20, true);
  write_file(file, bytes + fmt::format("\nhash {:016x}\n", content_hash(bytes)));  // which a fuzzer would not find
  write_room_file(file, read_room_file(file));
});

}  // namespace clerestory
