// Rooms made by rules from a seed: shell, windows before panoramas, lamps, furniture along the walls and in the middle.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/math/camera.hpp"
#include "tracer/furniture.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// Which part of the content a room may use. Training rooms never show the held-out panoramas, texture family,
/// furniture class and model; held-out rooms always show them, and prominently: the view outside, floor and furniture
/// bodies, a bed, the model on a pedestal.
enum class Setting { Training, HeldOut };

/// Share of training rooms in which any surface may have any texture, and solids of any shape lie about.
inline constexpr float kWildRooms = 0.25f;

/// Content kept out of training rooms.
inline const std::vector<std::string> kHeldOutPanoramas = {"apartment", "lobby"};
inline constexpr Texture kHeldOutTexture = Texture::Stone;
inline const std::string kHeldOutFurniture = "bed";
inline const std::string kHeldOutModel = "suzi";

struct NamedPanorama {
  std::string name;
  Panorama panorama;
  bool dark = false;  // a few bright spots in the dark: no daylight that a room could live on
};

/// Panoramas and models of a setting.
struct RoomAssets {
  std::vector<NamedPanorama> panoramas;
  std::vector<Model> models;
};

/// The panorama of that name: an asset's, or a sky's. Throws usage_error naming `room` when the assets lack it.
Panorama outside_of(const std::string& room, const std::string& name, const RoomAssets& assets);

/// Reads <folder>/hdri/*.exr and <folder>/models/*.glb that the setting allows, by name. Negative radiance becomes 0.
/// Throws usage_error when a folder is missing or holds nothing of the setting.
RoomAssets load_assets(const std::filesystem::path& folder, Setting setting);
/// Of the names and bytes of all that it reads, of either setting.
std::string hash_of_assets(const std::filesystem::path& folder);

/// A floor rectangle that something stands on, up to `height`.
struct Occupied {
  float x0 = 0, z0 = 0, x1 = 0, z1 = 0, height = 0;
  std::string name;
};

/// A rectangle of floor under a ceiling.
struct Floor {
  float x0 = 0, z0 = 0, x1 = 0, z1 = 0, height = 0;
};

struct Room {
  World scene;
  std::vector<Part> parts;    // what the scene's triangles are made from, in their order
  glm::vec3 size{0};          // width (x), height, depth (z); the floor's middle is the origin
  std::vector<Floor> floors;  // the room's own, then those of its recesses
  std::vector<Occupied> occupied;
  std::string kind;                  // living, dining, bedroom, office, kitchen, bathroom, studio
  Content content = Content::Plain;  // what its palette drew from; files do not keep it
  std::string panorama;              // name of the one outside: an asset's, or a sky's (tracer/sky.hpp)
};

/// The room of a seed. Equal arguments give equal rooms.
Room make_room(std::uint64_t seed, Setting setting, const RoomAssets& assets);

/// A bare box of a room with a lamp, a window-less door and a few blocks and balls: for tests and first steps.
Room make_box_room(std::uint64_t seed);

}  // namespace clerestory
