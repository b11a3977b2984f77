// Lists of generated rooms, as files: on one constants are chosen, on another all is judged.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "tracer/room_file.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// A text file: a line "setting held_out" or "setting training", then the seed of a room a line; "#" begins a comment.
struct RoomList {
  std::filesystem::path file;
  Setting setting = Setting::HeldOut;
  std::vector<std::uint64_t> seeds;
  /// The file NAME.rooms beside a list NAME.txt: what its rooms were like when it was begun, by their seeds. Empty
  /// where there is none: rooms are what the rules make of their seeds now.
  std::filesystem::path described;
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
  const RoomAssets& assets;                    // of that setting
  const RoomDescription* described = nullptr;  // in the file beside the list, if there is one

  Room make() const { return described ? described->build(assets) : make_room(seed, setting, assets); }
  /// Cameras of the room that make() gave. Throws usage_error where a file describes fewer, or of another shape.
  std::vector<Camera> cameras(TraceScene& traced, const Room& room, int count, int width, int height) const;
};

}  // namespace clerestory
