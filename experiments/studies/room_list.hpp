// Lists of generated rooms, as files: on one constants are chosen, on another all is judged.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "tracer/room.hpp"

namespace clerestory {

/// A text file: a line "setting held_out" or "setting training", then the seed of a room a line; "#" begins a comment.
struct RoomList {
  std::filesystem::path file;
  Setting setting = Setting::HeldOut;
  std::vector<std::uint64_t> seeds;
};

/// A relative name is looked for in the working folder, then beside the assets. Throws usage_error naming the file and
/// the line: no such file, no setting, not a seed, a room named twice.
RoomList read_room_list(const std::filesystem::path& file);
/// `count` rooms of a list: its first with `draw` 0, else drawn from all of them. Throws usage_error where it has
/// fewer.
RoomList rooms_of(RoomList list, std::size_t count, std::uint64_t draw);

/// One room of a list, ready to be made.
struct ListedRoom {
  std::int64_t index = 0;  // in the list
  std::uint64_t seed = 0;
  Setting setting = Setting::HeldOut;
  const RoomAssets& assets;  // of that setting

  Room make() const { return make_room(seed, setting, assets); }
};

}  // namespace clerestory
