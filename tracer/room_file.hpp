// Rooms as files: the parts, materials, lamps and cameras of generated rooms, so that a list of rooms stays the same
// when the rules that made it change. One file holds many rooms, some ten kilobytes each.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/math/camera.hpp"
#include "tracer/parts.hpp"
#include "tracer/room.hpp"

namespace clerestory {

/// All that a room is but panorama and models, which it names.
struct RoomDescription {
  std::string name;
  std::uint64_t seed = 0;      // of the random numbers of its pictures
  std::string kind, panorama;  // as in Room; no panorama: nothing is seen of an outside
  float panorama_turn = 0;
  glm::vec3 size{0};
  std::vector<Part> parts;
  std::vector<Material> materials;
  std::vector<Emitter> emitters;
  std::vector<Camera> cameras;

  /// Without `occupied`: where furniture stands is known by its parts alone. Throws usage_error naming what the assets
  /// lack.
  Room build(const RoomAssets& assets) const;
  /// The first `count` cameras, of so many pixels. Throws usage_error where there are fewer, or of another shape.
  std::vector<Camera> views(int count, int width, int height) const;
};

RoomDescription describe_room(const std::string& name, std::uint64_t seed, const Room& room,
                              std::vector<Camera> cameras);

/// Rooms of one setting.
struct RoomFile {
  Setting setting = Setting::Training;
  std::vector<RoomDescription> rooms;
};

/// The oldest format that holds the rooms, so that programs of before read what they can. 1: as when such files began;
/// 2: also what is turned, blobs, cloths, prints, smudges and stains.
int format_of(const RoomFile& file);

/// What tracer/column_file.hpp packs. Equal rooms give equal bytes.
std::string columns_of(const RoomFile& file);
void write_room_file(const std::filesystem::path& path, const RoomFile& file);

/// Throws usage_error naming the file and what is wrong: another file, a damaged or missing column, a number
/// that is not finite, an index out of range.
RoomFile read_room_file(const std::filesystem::path& path);

/// The rooms with these seeds, in their order. Throws usage_error naming `where` and the seed that no room has.
RoomFile rooms_of_seeds(const RoomFile& file, const std::vector<std::uint64_t>& seeds, const std::string& where);

}  // namespace clerestory
