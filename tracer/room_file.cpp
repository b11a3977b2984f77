#include "tracer/room_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tracer/column_file.hpp"
#include "tracer/sky.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 2;
constexpr int kMostSteps = 256;  // of a round part: its triangles grow with their square
constexpr std::size_t kMaterialReals = sizeof(Material) / sizeof(float), kPoseReals = 12, kCameraReals = 20;

/// Rows of `reals` numbers, stored field by field: a field's values are alike, and pack well.
template <class T>
std::vector<T> by_field(const std::vector<T>& rows, std::size_t reals, bool back = false) {
  const std::size_t count = rows.size() / reals;
  std::vector<T> out(rows.size());
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < reals; ++k) {
      const std::size_t row = i * reals + k, field = k * count + i;
      (back ? out[row] : out[field]) = back ? rows[field] : rows[row];
    }
  return out;
}

/// Whether a part of that kind has so many numbers.
bool has_its_numbers(PartKind kind, std::size_t count) {
  switch (kind) {
    case PartKind::Quad:
      return count == 14;
    case PartKind::Canvas:
      return count == 12;
    case PartKind::Box:
    case PartKind::Curtain:
      return count == 6;
    case PartKind::Cushion:
    case PartKind::Cloth:
      return count == 7;
    case PartKind::Blob:
      return count == 9;
    case PartKind::Lathe:
    case PartKind::Turned:
      return count >= 7 && count % 2 == 1;
    case PartKind::Disc:
    case PartKind::Sphere:
    case PartKind::Mesh:
      return count == 4;
    case PartKind::Tube:
      return count >= 7 && count % 3 == 1;
  }
  return false;
}

/// What a row of a column tells of; the first four in the order of Columns::counts.
enum RowOf { kOfPart, kOfMaterial, kOfEmitter, kOfCamera, kOfRoom, kOfNumber };

/// What stands in the file, column by column.
struct Columns {
  std::vector<std::string> names, kinds, panoramas, models;
  std::vector<std::uint64_t> seeds;
  std::vector<float> shape;          // size and turn of the panorama: 4 a room
  std::vector<std::int32_t> counts;  // parts, materials, emitters, cameras: 4 a room
  std::vector<std::uint8_t> kind, open;
  std::vector<std::int32_t> material, emitter, steps, model, numbers_of_part;
  std::vector<float> pose, shift, numbers;
  std::vector<float> materials, emitters;  // an emitter: radiance, 1 where it shows the panorama
  std::vector<double> cameras;             // fx, fy, cx, cy, camera_to_world
  std::vector<std::int32_t> pixels;        // width, height of each camera

  /// Each column's name, what has a row in it, and the numbers of a row; counts before what they count.
  template <class Each>
  void each(Each&& visit) {
    visit("seed", kOfRoom, seeds, 1), visit("shape", kOfRoom, shape, 4), visit("counts", kOfRoom, counts, 4);
    visit("part_kind", kOfPart, kind, 1), visit("part_open", kOfPart, open, 1);
    visit("part_material", kOfPart, material, 1), visit("part_emitter", kOfPart, emitter, 1);
    visit("part_steps", kOfPart, steps, 1), visit("part_model", kOfPart, model, 1);
    visit("part_numbers", kOfPart, numbers_of_part, 1), visit("part_pose", kOfPart, pose, kPoseReals);
    visit("part_shift", kOfPart, shift, 3), visit("numbers", kOfNumber, numbers, 1);
    visit("material", kOfMaterial, materials, kMaterialReals), visit("emitter", kOfEmitter, emitters, 4);
    visit("camera", kOfCamera, cameras, kCameraReals), visit("camera_pixels", kOfCamera, pixels, 2);
  }
};

std::int32_t whole(std::size_t n) { return static_cast<std::int32_t>(n); }

void append(Columns& c, const Part& p) {
  c.kind.push_back(static_cast<std::uint8_t>(p.kind)), c.open.push_back(p.open);
  c.material.push_back(p.material), c.emitter.push_back(p.emitter), c.steps.push_back(p.steps);
  c.model.push_back(-1);
  if (p.kind == PartKind::Mesh) {
    const auto at = std::ranges::find(c.models, p.model);
    c.model.back() = whole(static_cast<std::size_t>(at - c.models.begin()));
    if (at == c.models.end()) c.models.push_back(p.model);
  }
  c.numbers_of_part.push_back(whole(p.numbers.size()));
  c.numbers.insert(c.numbers.end(), p.numbers.begin(), p.numbers.end());
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) c.pose.push_back(p.to_room[column][row]);
  c.shift.insert(c.shift.end(), {p.shift.x, p.shift.y, p.shift.z});
}

void append(Columns& c, const RoomDescription& room) {
  c.names.push_back(room.name), c.kinds.push_back(room.kind), c.panoramas.push_back(room.panorama);
  c.seeds.push_back(room.seed);
  c.shape.insert(c.shape.end(), {room.size.x, room.size.y, room.size.z, room.panorama_turn});
  c.counts.insert(c.counts.end(), {whole(room.parts.size()), whole(room.materials.size()), whole(room.emitters.size()),
                                   whole(room.cameras.size())});
  for (const Part& part : room.parts) append(c, part);
  for (const Material& m : room.materials) {
    std::array<float, kMaterialReals> reals;
    std::memcpy(reals.data(), &m, sizeof m);
    c.materials.insert(c.materials.end(), reals.begin(), reals.end());
  }
  for (const Emitter& e : room.emitters)
    c.emitters.insert(c.emitters.end(), {e.radiance.x, e.radiance.y, e.radiance.z, e.panorama ? 1.f : 0.f});
  for (const Camera& camera : room.cameras) {
    c.cameras.insert(c.cameras.end(), {camera.fx, camera.fy, camera.cx, camera.cy});
    c.cameras.insert(c.cameras.end(), camera.camera_to_world.begin(), camera.camera_to_world.end());
    c.pixels.insert(c.pixels.end(), {camera.width, camera.height});
  }
}

/// Rooms of columns, from the first on.
class Rooms {
 public:
  Rooms(const ColumnReader& from, const Columns& c) : from_(from), c_(c) {}

  RoomDescription next() {
    const std::size_t r = room_++;
    RoomDescription room;
    check_name(c_.names[r]);
    room.name = c_.names[r], room.seed = c_.seeds[r], room.kind = c_.kinds[r], room.panorama = c_.panoramas[r];
    const float* shape = c_.shape.data() + 4 * r;
    room.size = {shape[0], shape[1], shape[2]}, room.panorama_turn = shape[3];
    const std::int32_t* counts = c_.counts.data() + 4 * r;
    for (int i = 0; i < counts[1]; ++i) room.materials.push_back(material(room.name));
    for (int i = 0; i < counts[2]; ++i) {
      const float* e = c_.emitters.data() + 4 * emitter_++;
      if (!(std::min({e[0], e[1], e[2]}) >= 0))
        from_.fail("a lamp sends out less than nothing", room.name, "radiance of at least 0");
      room.emitters.push_back({{e[0], e[1], e[2]}, e[3] != 0});
    }
    for (int i = 0; i < counts[0]; ++i) room.parts.push_back(part(counts[1], counts[2], room.name));
    for (int i = 0; i < counts[3]; ++i) room.cameras.push_back(camera(room.name));
    return room;
  }

 private:
  /// Rooms are written to folders of their name.
  void check_name(const std::string& name) const {
    if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos ||
        name.find('\0') != std::string::npos)
      from_.fail("a room's name is not fit for a folder", name, "no / and no . at its beginning");
  }

  Material material(const std::string& room) {
    Material m;
    std::memcpy(static_cast<void*>(&m), c_.materials.data() + kMaterialReals * material_++, sizeof m);
    if (m.texture != std::floor(m.texture) || m.texture < 0 || m.texture > static_cast<float>(Texture::Print))
      from_.fail("a material has a texture that this program does not know", fmt::format("{} in {}", m.texture, room),
                 fmt::format("a whole number from 0 to {}", static_cast<int>(Texture::Print)));
    return m;
  }

  Part part(int materials, int emitters, const std::string& room) {
    const std::size_t i = part_++;
    Part p;
    p.kind = static_cast<PartKind>(c_.kind[i]), p.open = c_.open[i] != 0, p.steps = c_.steps[i];
    p.material = c_.material[i], p.emitter = c_.emitter[i];
    const auto count = static_cast<std::size_t>(c_.numbers_of_part[i]);
    const bool mesh = p.kind == PartKind::Mesh, round = p.kind >= PartKind::Cushion && !mesh;
    if (!has_its_numbers(p.kind, count) || p.material < 0 || p.material >= materials || p.emitter < -1 ||
        p.emitter >= emitters || (round && (p.steps < 1 || p.steps > kMostSteps)) ||
        mesh != (c_.model[i] >= 0 && c_.model[i] < whole(c_.models.size())))
      from_.fail("a part makes no sense", fmt::format("{} in {}", i, room), "a kind, its numbers, material and model");
    const auto first = c_.numbers.begin() + static_cast<std::ptrdiff_t>(number_);
    p.numbers.assign(first, first + static_cast<std::ptrdiff_t>(count)), number_ += count;
    if (mesh) p.model = c_.models[static_cast<std::size_t>(c_.model[i])];
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row)
        p.to_room[column][row] = c_.pose[kPoseReals * i + static_cast<std::size_t>(3 * column + row)];
    p.shift = {c_.shift[3 * i], c_.shift[3 * i + 1], c_.shift[3 * i + 2]};
    return p;
  }

  Camera camera(const std::string& room) {
    const std::size_t i = camera_++;
    Camera c;
    const double* reals = c_.cameras.data() + kCameraReals * i;
    c.width = c_.pixels[2 * i], c.height = c_.pixels[2 * i + 1];
    c.fx = reals[0], c.fy = reals[1], c.cx = reals[2], c.cy = reals[3];
    std::copy_n(reals + 4, 16, c.camera_to_world.begin());
    c.check(fmt::format("{}: a camera of {}", from_.path().string(), room));
    return c;
  }

  const ColumnReader& from_;
  const Columns& c_;
  std::size_t room_ = 0, part_ = 0, number_ = 0, material_ = 0, emitter_ = 0, camera_ = 0;
};

/// Sum over rooms of one of their four counts.
std::size_t sum_of(const ColumnReader& from, const std::vector<std::int32_t>& values, std::size_t first,
                   std::size_t step) {
  std::size_t sum = 0;
  for (std::size_t i = first; i < values.size(); i += step) {
    if (values[i] < 0) from.fail("a count is negative", fmt::format("{}", values[i]), "0 or more");
    sum += static_cast<std::size_t>(values[i]);
  }
  return sum;
}

Columns read_columns(ColumnReader& from) {
  Columns c;
  c.names = from.names("name"), c.kinds = from.names("kind"), c.panoramas = from.names("panorama");
  c.models = from.names("model");
  const std::size_t rooms = c.names.size();
  if (c.kinds.size() != rooms || c.panoramas.size() != rooms)
    from.fail("names are missing", fmt::format("{} kinds, {} panoramas", c.kinds.size(), c.panoramas.size()),
              fmt::format("{} of each", rooms));
  const auto rows = [&](RowOf what) {
    if (what == kOfRoom) return rooms;
    if (what == kOfNumber) return sum_of(from, c.numbers_of_part, 0, 1);
    return sum_of(from, c.counts, what, 4);
  };
  c.each([&]<class T>(const char* name, RowOf what, std::vector<T>& to, std::size_t fields) {
    to = by_field(from.column<T>(name, rows(what) * fields), fields, true);
  });
  return c;
}

}  // namespace

RoomDescription describe_room(const std::string& name, std::uint64_t seed, const Room& room,
                              std::vector<Camera> cameras) {
  return {name,
          seed,
          room.kind,
          room.panorama,
          room.scene.panorama_turn,
          room.size,
          room.parts,
          room.scene.materials,
          room.scene.emitters,
          std::move(cameras)};
}

Room RoomDescription::build(const RoomAssets& assets) const {
  Room room;
  room.size = size, room.kind = kind, room.panorama = panorama, room.parts = parts;
  room.scene.materials = materials, room.scene.emitters = emitters, room.scene.panorama_turn = panorama_turn;
  if (!panorama.empty()) room.scene.panorama = outside_of(name, panorama, assets);
  for (const Part& part : parts) {
    const auto model = std::ranges::find(assets.models, part.model, &Model::name);
    if (part.kind == PartKind::Mesh && model == assets.models.end())
      throw usage_error("no such model among the assets", name, part.model);
    add_part(room.scene, part, part.kind == PartKind::Mesh ? &model->mesh : nullptr);
  }
  return room;
}

std::vector<Camera> RoomDescription::views(int count, int width, int height) const {
  if (static_cast<std::size_t>(count) > cameras.size())
    throw usage_error("a room of the file has fewer views", name, fmt::format("{}", cameras.size()),
                      fmt::format("{} (--views)", count));
  std::vector<Camera> views;
  for (int v = 0; v < count; ++v) {
    const Camera& camera = cameras[static_cast<std::size_t>(v)];
    if (std::int64_t{camera.width} * height != std::int64_t{camera.height} * width)
      throw usage_error("of another shape than the views of the file", name, fmt::format("{}x{}", width, height),
                        fmt::format("a multiple of {}x{}", camera.width, camera.height));
    views.push_back(camera.resized(width, height));
  }
  return views;
}

int format_of(const RoomFile& file) {
  const auto begun_with = [](const RoomDescription& room) {
    return !sunny_seed(room.panorama) &&
           std::ranges::all_of(room.parts, [](const Part& p) { return p.kind <= PartKind::Tube; }) &&
           std::ranges::all_of(room.materials, [](const Material& m) {
             return m.texture <= static_cast<float>(Texture::Painting) && m.smudge == 0 && m.stain == 0;
           });
  };
  return std::ranges::all_of(file.rooms, begun_with) ? 1 : kFormat;
}

std::string columns_of(const RoomFile& file) {
  Columns c;
  for (const RoomDescription& room : file.rooms) append(c, room);
  ColumnWriter to;
  to.column(std::vector<std::int32_t>{format_of(file), file.setting == Setting::HeldOut});
  to.names(c.names), to.names(c.kinds), to.names(c.panoramas), to.names(c.models);
  c.each([&](const char*, RowOf, const auto& values, std::size_t fields) { to.column(by_field(values, fields)); });
  return to.columns();
}

void write_room_file(const fs::path& path, const RoomFile& file) { write_file(path, packed_columns(columns_of(file))); }

RoomFile read_room_file(const fs::path& path) {
  ColumnReader from(path);
  const std::vector<std::int32_t> format = from.column<std::int32_t>("format", 2);
  if (format[0] < 1 || format[0] > kFormat)
    from.fail("of another format", fmt::format("{}", format[0]), fmt::format("1 to {}", kFormat));
  const Columns columns = read_columns(from);
  from.end();
  RoomFile file{format[1] != 0 ? Setting::HeldOut : Setting::Training, {}};
  Rooms rooms(from, columns);
  for (std::size_t r = 0; r < columns.names.size(); ++r) file.rooms.push_back(rooms.next());
  return file;
}

RoomFile rooms_of_seeds(const RoomFile& file, const std::vector<std::uint64_t>& seeds, const std::string& where) {
  RoomFile chosen{file.setting, {}};
  for (const std::uint64_t seed : seeds) {
    const auto room = std::ranges::find(file.rooms, seed, &RoomDescription::seed);
    if (room == file.rooms.end())
      throw usage_error("no room of the file has this seed", where, fmt::format("{}", seed), "a seed of its rooms");
    chosen.rooms.push_back(*room);
  }
  return chosen;
}

}  // namespace clerestory
