#include "tracer/room.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "tracer/furnish.hpp"
#include "tracer/room_shell.hpp"
#include "tracer/sky.hpp"

namespace clerestory {
namespace {

constexpr float kQuarter = std::numbers::pi_v<float> / 2;

/// Brightest part of a panorama over its mean. Small suns make patches of light whose reflections 64 samples do not
/// resolve; real lamps in view reach about this.
constexpr float kMostSky = 40;

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void set_mean_to_one(std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += static_cast<double>(v);
  const float scale = static_cast<float>(static_cast<double>(values.size()) / std::max(sum, 1e-6));
  for (float& v : values) v *= scale;
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder, const std::string& extension) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  if (error) throw usage_error("cannot be listed: " + error.message(), folder.string());
  std::sort(files.begin(), files.end());
  return files;
}

/// Share of training rooms that look out on a sky made by rules, and of these skies that of strong suns.
constexpr float kSkies = 0.75f, kSunny = 0.4f;

}  // namespace

RoomAssets load_assets(const std::filesystem::path& folder, Setting setting) {
  const bool held_out = setting == Setting::HeldOut;
  RoomAssets assets;
  for (const auto& file : files_in(folder / "hdri", ".exr")) {
    const std::string name = file.stem().string();
    if (contains(kHeldOutPanoramas, name) != held_out) continue;
    Image image = read_image(file);
    if (image.channels != 3)
      throw usage_error("not a panorama", file.string(), std::to_string(image.channels) + " channels", "3");
    check_radiance(image, file);
    Panorama p{image.width, image.height, std::vector<float>(image.data.size())};
    for (std::size_t i = 0; i < image.pixels(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) p.rgb[3 * i + c] = image.data[c * image.pixels() + i];
    }
    // Panoramas have units of their own: a mean of 1 makes windows of all of them alike in strength.
    set_mean_to_one(p.rgb);
    for (float& v : p.rgb) v = std::min(v, kMostSky);
    set_mean_to_one(p.rgb);
    std::vector<float> sorted = p.rgb;
    const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), median, sorted.end());
    const bool dark = *median < 0.05f;
    assets.panoramas.push_back({name, std::move(p), dark});
  }
  for (const auto& file : files_in(folder / "models", ".glb")) {
    const std::string name = file.stem().string();
    if ((name == kHeldOutModel) == held_out) assets.models.push_back({name, read_mesh(file)});
  }
  if (assets.panoramas.empty()) throw usage_error("no panorama of the setting", (folder / "hdri").string());
  if (assets.models.empty()) throw usage_error("no model of the setting", (folder / "models").string());
  return assets;
}

std::string hash_of_assets(const std::filesystem::path& folder) {
  std::uint64_t hash = content_hash("assets");
  for (const auto& [below, extension] : {std::pair{"hdri", ".exr"}, std::pair{"models", ".glb"}})
    for (const auto& file : files_in(folder / below, extension))
      hash = content_hash(file.filename().string() + file_hash(file), hash);
  return fmt::format("{:016x}", hash);
}

Panorama outside_of(const std::string& room, const std::string& name, const RoomAssets& assets) {
  if (const std::optional<std::uint64_t> sky = sky_seed(name)) return make_sky(*sky);
  if (const std::optional<std::uint64_t> sky = sunny_seed(name)) return make_sunny_sky(*sky);
  const auto outside = std::ranges::find(assets.panoramas, name, &NamedPanorama::name);
  if (outside == assets.panoramas.end()) throw usage_error("no such panorama among the assets", room, name);
  return outside->panorama;
}

namespace {

/// Day, evening or night: strong daylight with or without lamps, both alike, or lamps only.
ShellStyle choose_style(Random& random, bool dark) {
  ShellStyle style;
  const float hour = random.unit();
  style.daylight = hour < 0.45f  ? random.between(2.f, 8.f)
                   : hour < 0.8f ? random.between(0.4f, 2.f)
                                 : random.between(0.01f, 0.08f);
  style.lamps_on = hour >= 0.25f || dark;
  style.lamp_power = random.between(0.5f, 1.5f);
  return style;
}

/// Further apart than people's rooms are, so that few are beyond: dim evenings, a lamp or two, wide windows at noon.
ShellStyle choose_varied_style(Random& random, bool dark) {
  ShellStyle style;
  const float hour = random.unit();
  style.daylight = hour < 0.75f ? random.log_between(0.4f, 10) : random.log_between(0.005f, 0.2f);
  style.lamps_on = hour >= 0.25f || dark;
  style.lamp_power = random.log_between(0.3f, 2.5f);
  return style;
}

/// The panorama outside. Returns whether it is too dark for a room to live on.
bool choose_outside(Room& room, const RoomAssets& assets, bool held_out, Random& random) {
  const NamedPanorama& one = random.one_of(assets.panoramas);
  const bool sky = !held_out && random.chance(kSkies);
  const bool sunny = sky && random.chance(kSunny);
  room.panorama = sunny ? sunny_name(random.bits()) : sky ? sky_name(random.bits()) : one.name;
  room.scene.panorama = outside_of("", room.panorama, assets);
  room.scene.panorama_turn = random.between(0, 4 * kQuarter);
  return !sky && one.dark;
}

/// Lets a strong sun shine through one of the windows, most often.
void turn_to_sun(Room& room, const std::vector<Wall>& walls, Random random) {
  const std::optional<std::uint64_t> sky = sunny_seed(room.panorama);
  if (!sky || !random.chance(0.8f)) return;
  std::vector<glm::vec3> out;
  for (const Wall& wall : walls)
    for (const Opening& o : wall.openings)
      if (o.kind == Opening::Window) out.push_back(-glm::vec3(wall.to_room[2]));
  if (out.empty()) return;
  const glm::vec3 way = random.one_of(out);
  room.scene.panorama_turn = sun_azimuth(*sky) - std::atan2(way.x, -way.z) + random.between(-1, 1);
}

}  // namespace

Room make_room(std::uint64_t seed, Setting setting, const RoomAssets& assets) {
  const bool held_out = setting == Setting::HeldOut;
  const Random root(seed);
  Random random = root.fork(1), furniture = root.fork(6);
  const std::vector<std::string> kinds = {"living", "living",  "dining",   "bedroom", "office",
                                          "office", "kitchen", "bathroom", "studio"};
  Room room;
  room.kind = held_out && furniture.chance(0.7f) ? "bedroom" : furniture.one_of(kinds);
  const bool small = room.kind == "bathroom" && !held_out;
  room.size = {random.between(small ? 2.2f : 2.8f, small ? 3.6f : 6.5f), random.between(2.35f, 3.1f),
               random.between(small ? 2.2f : 2.8f, small ? 3.6f : 6.0f)};
  const bool dark = choose_outside(room, assets, held_out, random);
  ShellStyle style = held_out ? choose_style(random, dark) : choose_varied_style(random, dark);
  style.tiled_walls = room.kind == "bathroom" && random.chance(0.6f);
  const bool windowed = held_out || !style.lamps_on || random.chance(0.8f);

  room.content = held_out ? Content::HeldOut : root.fork(7).chance(kWildRooms) ? Content::Wild : Content::Varied;
  Palette palette(root.fork(2), room.content);
  const Kit kit{&palette, &assets.models, style.lamp_power, style.lamps_on ? 0.75f : 0.25f};
  Shapes shapes(room.scene, glm::mat4(1), root.fork(3), &room.parts);
  std::vector<Wall> walls = make_walls(room.size);
  Random openings = root.fork(4);
  choose_openings(walls, room.size.y, windowed, true, openings);
  turn_to_sun(room, walls, root.fork(8));
  room.floors = floors_of(walls, room.size);
  build_shell(shapes, walls, room.floors, palette, style);
  furnish_recesses(shapes, walls, kit);

  Layout layout(room, walls, shapes, root.fork(5));
  const Furnisher furnisher(layout, kit, shapes, room.size, furniture);
  if (held_out) {
    layout.against_wall(bed(kit, furniture), true);
    if (!assets.models.empty()) layout.against_wall(pedestal(kit, furniture, assets.models[0]), false, 0.12f);
  }
  furnisher.furnish(room.kind, held_out);
  const glm::vec4 pendant =
      room.kind == "dining" || room.kind == "kitchen" ? layout.last() * glm::vec4(0, 0, 0, 1) : glm::vec4(0);
  furnisher.fill();
  if (!held_out) furnisher.further();
  furnisher.litter();

  const bool central = std::abs(pendant.x) < room.size.x * 0.3f && std::abs(pendant.z) < room.size.z * 0.3f;
  build_ceiling_lamps(shapes, room.size, palette, style, central ? glm::vec2(pendant.x, pendant.z) : glm::vec2(0));
  decorate_walls(shapes, walls, kit);
  return room;
}

Room make_box_room(std::uint64_t seed) {
  const Random root(seed);
  Random random = root.fork(1);
  Room room;
  room.size = {4, 2.6f, 4};
  room.kind = "box";
  Palette palette(root.fork(2), Content::Plain);
  Shapes shapes(room.scene, glm::mat4(1), root.fork(3), &room.parts);
  std::vector<Wall> walls = make_walls(room.size);
  ShellStyle style;
  style.daylight = 0;
  choose_openings(walls, room.size.y, false, false, random);
  room.floors = floors_of(walls, room.size);
  build_shell(shapes, walls, room.floors, palette, style);
  Kit kit{&palette, nullptr, 1, 1};
  Layout layout(room, walls, shapes, root.fork(5));
  for (int i = 0; i < 3; ++i) layout.against_wall(box_stack(kit, random));
  layout.in_the_open(side_table(kit, random), 0.5f);
  for (int i = 0; i < 3; ++i) layout.in_the_open(ball(kit, random), 0.7f, true);
  build_ceiling_lamps(shapes, room.size, palette, style, glm::vec2(0));
  return room;
}

}  // namespace clerestory
