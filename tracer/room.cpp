#include "tracer/room.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "host/error.hpp"
#include "host/io/image.hpp"
#include "tracer/room_shell.hpp"

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

/// Where furniture goes: keeps pieces apart, doors free and windows unblocked.
class Layout {
 public:
  Layout(Room& room, std::vector<Wall>& walls, Shapes& shapes, Random random)
      : room_(room), walls_(walls), shapes_(shapes), random_(random) {
    for (const Wall& wall : walls_) {
      for (const Opening& o : wall.openings) {
        if (o.window) continue;
        reserve(wall.to_room, (o.x0 + o.x1) / 2, (o.x1 - o.x0) / 2, 0, 0.85f);
      }
    }
  }

  /// With its back to a wall; at a random stretch that is free. `centred`: in the middle of the wall if possible.
  bool against_wall(const Piece& piece, bool centred = false, float gap = 0.02f) {
    for (int attempt = 0; attempt < 16; ++attempt) {
      const std::size_t k = static_cast<std::size_t>(random_.whole(0, 3));
      Wall& wall = walls_[k];
      const float slack = wall.length / 2 - piece.size.x / 2 - 0.03f;
      if (slack < 0) continue;
      const float x = centred && attempt < 8 ? random_.between(-0.2f, 0.2f) * slack : random_.between(-slack, slack);
      if (!wall.is_free(x - piece.size.x / 2, x + piece.size.x / 2, 0.02f) && blocks(wall, x, piece)) continue;
      const glm::mat4 pose = glm::translate(wall.to_room, {x, 0, piece.size.z / 2 + gap});
      if (!place(piece, pose)) continue;
      wall.taken.push_back({x - piece.size.x / 2, x + piece.size.x / 2, piece.size.y});
      last_ = pose;
      return true;
    }
    return false;
  }

  /// Away from the walls, turned by quarters and a little.
  bool in_the_open(const Piece& piece, float spread, bool turn_freely = false) {
    for (int attempt = 0; attempt < 16; ++attempt) {
      const float x = random_.between(-0.5f, 0.5f) * spread * room_.size.x,
                  z = random_.between(-0.5f, 0.5f) * spread * room_.size.z;
      const float turn = turn_freely
                             ? random_.between(0, 4 * kQuarter)
                             : kQuarter * static_cast<float>(random_.whole(0, 3)) + random_.between(-0.08f, 0.08f);
      const glm::mat4 pose = glm::rotate(glm::translate(glm::mat4(1), {x, 0, z}), turn, {0, 1, 0});
      if (place(piece, pose)) {
        last_ = pose;
        return true;
      }
    }
    return false;
  }

  /// In front of what was placed last, at `distance` from its middle, facing it when `facing`.
  bool before_last(const Piece& piece, float distance, bool facing) {
    glm::mat4 pose = glm::translate(last_, {0, 0, distance});
    if (facing) pose = glm::rotate(pose, 2 * kQuarter, {0, 1, 0});
    return place(piece, pose);
  }

  /// Beside what was placed last, at `distance` to its right or left.
  bool beside_last(const Piece& piece, float distance, float back) {
    const float side = random_.one_of({-1.f, 1.f});
    for (const float s : {side, -side}) {
      const glm::mat4 pose = glm::translate(last_, {s * distance, 0, back});
      if (place(piece, pose)) return true;
    }
    return false;
  }

  const glm::mat4& last() const { return last_; }
  Random& random() { return random_; }

 private:
  static bool blocks(const Wall& wall, float x, const Piece& piece) {
    const float x0 = x - piece.size.x / 2, x1 = x + piece.size.x / 2;
    for (const Opening& o : wall.openings) {
      if (x1 > o.x0 && x0 < o.x1 && (!o.window || piece.size.y > o.y0)) return true;
    }
    return std::any_of(wall.taken.begin(), wall.taken.end(),
                       [&](const Wall::Taken& t) { return x1 > t.x0 && x0 < t.x1; });
  }

  Occupied footprint(const glm::mat4& pose, const glm::vec3& size) const {
    Occupied o{1e9f, 1e9f, -1e9f, -1e9f, size.y, {}};
    for (const float x : {-0.5f, 0.5f}) {
      for (const float z : {-0.5f, 0.5f}) {
        const glm::vec4 p = pose * glm::vec4(x * size.x, 0, z * size.z, 1);
        o.x0 = std::min(o.x0, p.x), o.x1 = std::max(o.x1, p.x);
        o.z0 = std::min(o.z0, p.z), o.z1 = std::max(o.z1, p.z);
      }
    }
    return o;
  }

  void reserve(const glm::mat4& wall, float x, float half, float z0, float z1) {
    const glm::mat4 pose = glm::translate(wall, {x, 0, (z0 + z1) / 2});
    doors_.push_back(footprint(pose, {2 * half, 0, z1 - z0}));
  }

  bool place(const Piece& piece, const glm::mat4& pose) {
    Occupied o = footprint(pose, piece.size);
    o.name = piece.name;
    const float wx = room_.size.x / 2, wz = room_.size.z / 2;
    if (o.x0 < -wx || o.x1 > wx || o.z0 < -wz || o.z1 > wz) return false;
    const auto meets = [&](const Occupied& other) {
      return o.x1 > other.x0 - 0.03f && o.x0 < other.x1 + 0.03f && o.z1 > other.z0 - 0.03f && o.z0 < other.z1 + 0.03f;
    };
    if (std::any_of(room_.occupied.begin(), room_.occupied.end(), meets)) return false;
    if (std::any_of(doors_.begin(), doors_.end(), meets)) return false;
    room_.occupied.push_back(o);
    Shapes at = shapes_.at(pose);
    piece.build(at);
    return true;
  }

  Room& room_;
  std::vector<Wall>& walls_;
  Shapes& shapes_;
  Random random_;
  glm::mat4 last_{1};
  std::vector<Occupied> doors_;
};

void add_rug(Shapes& shapes, Palette& palette, const glm::mat4& pose, float width, float depth, const glm::vec3& room) {
  Shapes s = shapes.at(pose);
  const glm::vec4 middle = pose * glm::vec4(0, 0, 0, 1);
  const float most_x = 2 * (room.x / 2 - std::abs(middle.x)) - 0.1f,
              most_z = 2 * (room.z / 2 - std::abs(middle.z)) - 0.1f;
  const float most = std::max(0.6f, std::min(most_x, most_z));
  const float w = std::min(width, most) / 2, d = std::min(depth, most) / 2;
  const int m = s.material(palette.rug());
  s.canvas({-w, 0.008f, d}, {w, 0.008f, d}, {w, 0.008f, -d}, {-w, 0.008f, -d}, m);
}

struct Furnisher {
  Layout& layout;
  const Kit& kit;
  Shapes& shapes;
  const glm::vec3& size;
  Random& random;

  void living() const {
    const float width = random.between(1.5f, 2.3f);
    if (layout.against_wall(sofa(kit, random, width), true, random.chance(0.4f) ? random.between(0.1f, 0.5f) : 0.03f)) {
      const glm::mat4 at = layout.last();
      if (random.chance(0.7f))
        add_rug(shapes, *kit.palette, glm::translate(at, {0, 0, 1.1f}), random.between(1.8f, 2.6f),
                random.between(1.3f, 1.8f), size);
      layout.before_last(coffee_table(kit, random), random.between(1.05f, 1.25f), false);
      if (random.chance(0.6f)) layout.beside_last(floor_lamp(kit, random), width / 2 + 0.3f, -0.15f);
      if (random.chance(0.5f)) layout.beside_last(side_table(kit, random), width / 2 + 0.32f, 0);
      if (random.chance(0.5f))
        layout.before_last(sofa(kit, random, random.between(0.8f, 0.95f)), random.between(2.1f, 2.6f), true);
    }
    layout.against_wall(tv_stand(kit, random), true);
    layout.against_wall(random.chance(0.6f) ? bookshelf(kit, random) : cabinet(kit, random));
  }
  void dining() const {
    layout.in_the_open(dining_table(kit, random), 0.25f);
    if (random.chance(0.35f)) add_rug(shapes, *kit.palette, layout.last(), 2.4f, 1.8f, size);
    layout.against_wall(cabinet(kit, random), true);
    if (random.chance(0.5f)) layout.against_wall(bookshelf(kit, random));
  }
  void bedroom(bool with_bed) const {
    if (with_bed && layout.against_wall(bed(kit, random), true)) {
      const glm::mat4 at = layout.last();
      if (random.chance(0.5f)) add_rug(shapes, *kit.palette, glm::translate(at, {0, 0, 0.9f}), 2.2f, 1.5f, size);
      layout.beside_last(side_table(kit, random), 1.3f, -0.75f);
      layout.beside_last(side_table(kit, random), 1.3f, -0.75f);
    }
    layout.against_wall(wardrobe(kit, random));
    if (!with_bed) layout.against_wall(wardrobe(kit, random));
    layout.against_wall(random.chance(0.5f) ? cabinet(kit, random) : desk(kit, random));
  }
  void office() const {
    for (int i = random.whole(1, 2); i > 0; --i) layout.against_wall(desk(kit, random), false);
    layout.against_wall(bookshelf(kit, random));
    layout.against_wall(random.chance(0.5f) ? cabinet(kit, random) : bookshelf(kit, random));
  }
  void kitchen() const {
    const float longest = std::max(size.x, size.z);
    for (const float share : {0.85f, 0.65f, 0.5f}) {
      if (layout.against_wall(kitchen_row(kit, random, std::min(longest * share, 3.6f)), true, 0.005f)) break;
    }
    layout.in_the_open(dining_table(kit, random), 0.2f);
  }
  void studio() const {
    for (int i = random.whole(1, 3); i > 0; --i) layout.against_wall(box_stack(kit, random));
    layout.in_the_open(coffee_table(kit, random), 0.4f);
    for (int i = random.whole(1, 3); i > 0; --i) layout.in_the_open(ball(kit, random), 0.7f, true);
    layout.against_wall(cabinet(kit, random));
  }
  void fill() const {
    for (int i = random.whole(2, 5); i > 0; --i) {
      switch (random.whole(0, 9)) {
        case 0:
          layout.against_wall(bookshelf(kit, random));
          break;
        case 1:
          layout.against_wall(cabinet(kit, random));
          break;
        case 2:
          layout.against_wall(plant(kit, random), false, 0.08f);
          break;
        case 3:
          layout.against_wall(chair(kit, random));
          break;
        case 4:
          layout.in_the_open(stool(kit, random), 0.8f, true);
          break;
        case 5:
          layout.against_wall(box_stack(kit, random));
          break;
        case 6:
          layout.in_the_open(ball(kit, random), 0.85f, true);
          break;
        case 7:
          layout.against_wall(side_table(kit, random));
          break;
        case 8:
          layout.against_wall(floor_lamp(kit, random), false, 0.1f);
          break;
        default:
          layout.against_wall(sofa(kit, random, random.between(0.8f, 0.95f)), false, 0.1f);
          break;
      }
    }
    if (kit.models && !kit.models->empty() && random.chance(0.35f)) {
      layout.against_wall(pedestal(kit, random, random.one_of(*kit.models)), false, 0.12f);
    }
  }
};

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
  return assets;
}

Room make_room(std::uint64_t seed, Setting setting, const RoomAssets& assets) {
  const bool held_out = setting == Setting::HeldOut;
  const Random root(seed);
  Random random = root.fork(1);
  Room room;
  room.size = {random.between(2.8f, 6.5f), random.between(2.35f, 3.1f), random.between(2.8f, 6.0f)};

  const NamedPanorama& outside = random.one_of(assets.panoramas);
  room.panorama = outside.name;
  room.scene.panorama = outside.panorama;
  room.scene.panorama_turn = random.between(0, 4 * kQuarter);

  // Day, evening or night: strong daylight with or without lamps, both alike, or lamps only.
  ShellStyle style;
  const float hour = random.unit();
  style.daylight = hour < 0.45f  ? random.between(2.f, 8.f)
                   : hour < 0.8f ? random.between(0.4f, 2.f)
                                 : random.between(0.01f, 0.08f);
  style.lamps_on = hour >= 0.25f || outside.dark;
  style.lamp_power = random.between(0.5f, 1.5f);
  const bool windowed = held_out || !style.lamps_on || random.chance(0.8f);

  Palette palette(root.fork(2), held_out, !held_out);
  Kit kit{&palette, &assets.models, style.lamp_power, style.lamps_on ? 0.75f : 0.25f};
  Shapes shapes(room.scene, glm::mat4(1), root.fork(3), &room.parts);
  std::vector<Wall> walls = make_walls(room.size);
  Random openings = root.fork(4);
  choose_openings(walls, room.size.y, windowed, openings);
  build_shell(shapes, walls, room.size, palette, style);

  Layout layout(room, walls, shapes, root.fork(5));
  Random furniture = root.fork(6);
  const Furnisher furnish{layout, kit, shapes, room.size, furniture};
  const std::vector<std::string> kinds = {"living", "living", "dining",  "bedroom",
                                          "office", "office", "kitchen", "studio"};
  room.kind = held_out && furniture.chance(0.7f) ? "bedroom" : furniture.one_of(kinds);
  if (held_out) {
    layout.against_wall(bed(kit, furniture), true);
    if (!assets.models.empty()) layout.against_wall(pedestal(kit, furniture, assets.models[0]), false, 0.12f);
  }
  if (room.kind == "living") furnish.living();
  if (room.kind == "dining") furnish.dining();
  if (room.kind == "bedroom") furnish.bedroom(held_out);
  if (room.kind == "office") furnish.office();
  if (room.kind == "kitchen") furnish.kitchen();
  if (room.kind == "studio") furnish.studio();
  furnish.fill();

  const glm::vec4 pendant =
      room.kind == "dining" || room.kind == "kitchen" ? layout.last() * glm::vec4(0, 0, 0, 1) : glm::vec4(0);
  const bool central = std::abs(pendant.x) < room.size.x * 0.3f && std::abs(pendant.z) < room.size.z * 0.3f;
  build_ceiling_lamps(shapes, room.size, palette, style, central ? glm::vec2(pendant.x, pendant.z) : glm::vec2(0));
  decorate_walls(shapes, walls, room.size.y, kit);
  return room;
}

Room make_box_room(std::uint64_t seed) {
  const Random root(seed);
  Random random = root.fork(1);
  Room room;
  room.size = {4, 2.6f, 4};
  room.kind = "box";
  Palette palette(root.fork(2), false, true);
  Shapes shapes(room.scene, glm::mat4(1), root.fork(3), &room.parts);
  std::vector<Wall> walls = make_walls(room.size);
  ShellStyle style;
  style.daylight = 0;
  choose_openings(walls, room.size.y, false, random);
  build_shell(shapes, walls, room.size, palette, style);
  Kit kit{&palette, nullptr, 1, 1};
  Layout layout(room, walls, shapes, root.fork(5));
  for (int i = 0; i < 3; ++i) layout.against_wall(box_stack(kit, random));
  layout.in_the_open(side_table(kit, random), 0.5f);
  for (int i = 0; i < 3; ++i) layout.in_the_open(ball(kit, random), 0.7f, true);
  build_ceiling_lamps(shapes, room.size, palette, style, glm::vec2(0));
  return room;
}

}  // namespace clerestory
