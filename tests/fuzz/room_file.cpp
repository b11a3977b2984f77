// Descriptions of rooms. HDF5 spreads a room over 60 kB, so an input is what differs from a right file: two bytes of a
// place and one to put there, again and again.
#include "tracer/room_file.hpp"

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/fuzz/target.hpp"

namespace clerestory {
namespace {

const std::size_t trailer = fmt::format("\nhash {:016x}\n", 0).size();

std::string right_file(const std::filesystem::path& file) {
  write_room_file(file,
                  {Setting::Training, {describe_room("room", 1, make_box_room(1), {Camera::from_fov(16, 12, 60)})}});
  const std::string bytes = read_file(file);
  return bytes.substr(0, bytes.size() - trailer);
}

std::string changed(std::string bytes, const std::string& changes) {
  for (std::size_t i = 0; i + 2 < changes.size(); i += 3) {
    const auto at = static_cast<unsigned char>(changes[i]) << 8 | static_cast<unsigned char>(changes[i + 1]);
    bytes[static_cast<std::size_t>(at) % bytes.size()] = changes[i + 2];
  }
  return bytes;
}

const FuzzTarget target("room_file", "rooms.h5", [](const std::filesystem::path& file) {
  const std::string changes = read_file(file, 1 << 20, true);
  static const std::string right = right_file(file);
  const std::string bytes = changed(right, changes);
  write_file(file, bytes + fmt::format("\nhash {:016x}\n", content_hash(bytes)));  // which a fuzzer would not find
  write_room_file(file, read_room_file(file));
});

}  // namespace
}  // namespace clerestory
