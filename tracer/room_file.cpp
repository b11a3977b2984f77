#include "tracer/room_file.hpp"

#include <fmt/format.h>
#include <hdf5.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tracer/sky.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 2;
constexpr std::size_t kMaterialReals = sizeof(Material) / sizeof(float), kPoseReals = 12, kCameraReals = 20;
constexpr hsize_t kChunk = 1 << 16;            // most values that are compressed together
constexpr std::size_t kMost = 1u << 26;        // values of a column: a file that says more is damaged
constexpr std::uint64_t kMostBytes = 1 << 28;  // of a file
constexpr std::size_t kMostPacking = 2048;     // deflate packs 1032 to 1 at best

/// Behind the HDF5 file, which does not mind: HDF5 itself checks little of what it reads.
std::string trailer_of(std::string_view bytes) { return fmt::format("\nhash {:016x}\n", content_hash(bytes)); }
const std::size_t kTrailer = trailer_of("").size();

// --- Columns of an HDF5 file in memory
// --------------------------------------------------------------------------------

/// An HDF5 identifier with the function that closes it.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Values that are compressed together, of so many.
hsize_t chunk_of(hsize_t count) { return std::clamp<hsize_t>(count, 1, kChunk); }

/// How a number lies in files, and in memory.
struct NumberType {
  hid_t stored, native;
};
template <class T>
NumberType number_type() {
  if constexpr (std::is_same_v<T, float>) return {H5T_IEEE_F32LE, H5T_NATIVE_FLOAT};
  if constexpr (std::is_same_v<T, double>) return {H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE};
  if constexpr (std::is_same_v<T, std::uint8_t>) return {H5T_STD_U8LE, H5T_NATIVE_UINT8};
  if constexpr (std::is_same_v<T, std::int32_t>) return {H5T_STD_I32LE, H5T_NATIVE_INT32};
  if constexpr (std::is_same_v<T, std::uint64_t>) return {H5T_STD_U64LE, H5T_NATIVE_UINT64};
}

Handle memory_file() {
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fapl_core(access, 1 << 20, /*backing_store=*/false);
  return {access, H5Pclose};
}

class Writer {
 public:
  Writer() : access_(memory_file()), file_(H5Fcreate("rooms", H5F_ACC_TRUNC, H5P_DEFAULT, access_), H5Fclose) {}

  template <class T>
  void column(const char* name, const std::vector<T>& values) {
    const hsize_t count = values.size(), chunk = chunk_of(count);
    const Handle space(H5Screate_simple(1, &count, nullptr), H5Sclose), make(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(make, false);
    if (count > 0) {
      H5Pset_chunk(make, 1, &chunk), H5Pset_shuffle(make), H5Pset_deflate(make, 9);
    }
    const Handle set(H5Dcreate2(file_, name, number_type<T>().stored, space, H5P_DEFAULT, make, H5P_DEFAULT), H5Dclose);
    if (!set.good() || H5Dwrite(set, number_type<T>().native, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
      throw Error(ErrorKind::Failed, "HDF5 cannot write a column of rooms", name);
  }
  /// Names, a line each.
  void names(const char* name, const std::vector<std::string>& lines) {
    std::vector<std::uint8_t> text;
    for (const std::string& line : lines) text.insert(text.end(), line.begin(), line.end()), text.push_back('\n');
    column(name, text);
  }

  std::string bytes() {
    H5Fflush(file_, H5F_SCOPE_GLOBAL);
    const ssize_t size = H5Fget_file_image(file_, nullptr, 0);
    std::string all(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
    if (size <= 0 || H5Fget_file_image(file_, all.data(), all.size()) != size)
      throw Error(ErrorKind::Failed, "HDF5 cannot write a file of rooms");
    return all;
  }

 private:
  Handle access_, file_;
};

class Reader {
 public:
  explicit Reader(const fs::path& path) : path_(path), bytes_(read_file(path, kMostBytes)), access_(memory_file()) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const std::size_t size = bytes_.size() - std::min(bytes_.size(), kTrailer);
    if (bytes_.substr(size) != trailer_of({bytes_.data(), size}))
      fail("damaged, or another file", "bytes that do not give its hash", "what `clerestory generate` wrote");
    H5Pset_file_image(access_, bytes_.data(), size);
    file_ = H5Fopen("rooms", H5F_ACC_RDONLY, access_);
    if (file_ < 0) fail("not a file of rooms", "no HDF5", "what `clerestory generate --write-rooms` wrote");
  }
  ~Reader() {
    if (file_ >= 0) H5Fclose(file_);
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// All of a column, or `wanted` values of it.
  template <class T>
  std::vector<T> column(const char* name, std::size_t wanted = kAll) const {
    const Handle set(H5Dopen2(file_, name, H5P_DEFAULT), H5Dclose);
    if (!set.good()) fail("a column is missing", name, "a file that `clerestory generate --write-rooms` wrote");
    const Handle space(H5Dget_space(set), H5Sclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    if (count < 0 || static_cast<std::size_t>(count) > kMost ||
        (wanted != kAll && static_cast<std::size_t>(count) != wanted))
      fail("a column has another length", fmt::format("{}: {}", name, count),
           wanted == kAll ? "less" : fmt::format("{}", wanted));
    if (static_cast<std::size_t>(count) * sizeof(T) / kMostPacking > bytes_.size())
      fail("a column claims more than the file can hold", fmt::format("{}: {}", name, count),
           fmt::format("what fits into {} bytes", bytes_.size()));
    const Handle type(H5Dget_type(set), H5Tclose), made(H5Dget_create_plist(set), H5Pclose);
    const auto total = static_cast<hsize_t>(count);
    hsize_t chunk = 1;
    if (H5Tequal(type, number_type<T>().stored) <= 0 ||
        (total > 0 && (H5Pget_chunk(made, 1, &chunk) != 1 || chunk != chunk_of(total))))
      fail("a column lies otherwise", name, "as `clerestory generate --write-rooms` writes it");
    std::vector<T> values;
    for (hsize_t at = 0; at < total; at += chunk) {
      const std::vector<T> part = chunk_at<T>(set, at, static_cast<std::size_t>(chunk), name);
      values.insert(values.end(), part.begin(), part.begin() + static_cast<long>(std::min(chunk, total - at)));
    }
    if constexpr (std::is_floating_point_v<T>)
      if (!std::ranges::all_of(values, [](T v) { return std::isfinite(v); }))
        fail("a number is not finite", name, "finite numbers");
    return values;
  }
  std::vector<std::string> names(const char* name) const {
    std::vector<std::string> lines(1);
    for (const std::uint8_t c : column<std::uint8_t>(name)) {
      if (c == '\n')
        lines.emplace_back();
      else
        lines.back().push_back(static_cast<char>(c));
    }
    lines.pop_back();
    return lines;
  }

  [[noreturn]] void fail(const std::string& what, const std::string& found, const std::string& expected) const {
    throw usage_error("file of rooms: " + what, path_.string(), found, expected);
  }

  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

 private:
  /// Not by HDF5 1.10, which takes it for granted that a chunk inflates to all of its values, and that two tables of a
  /// damaged file give a chunk one size.
  template <class T>
  std::vector<T> chunk_at(const Handle& set, hsize_t at, std::size_t count, const char* name) const {
    static_assert(std::endian::native == std::endian::little, "as number_type() stores them");
    const auto expect = [&](bool holds) {
      if (!holds) fail("a column is damaged", name, "the bytes that were written");
    };
    haddr_t begin = 0;
    hsize_t size = 0;
    unsigned unfiltered = 0;
    expect(H5Dget_chunk_info_by_coord(set, &at, &unfiltered, &begin, &size) >= 0 && unfiltered == 0);
    expect(begin <= bytes_.size() && size <= bytes_.size() - begin);
    std::vector<unsigned char> shuffled(count * sizeof(T));
    uLongf length = shuffled.size();
    const auto* packed = reinterpret_cast<const unsigned char*>(bytes_.data()) + begin;
    expect(uncompress(shuffled.data(), &length, packed, size) == Z_OK && length == shuffled.size());
    std::vector<T> values(count);
    auto* bytes = reinterpret_cast<unsigned char*>(values.data());
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t b = 0; b < sizeof(T); ++b) bytes[i * sizeof(T) + b] = shuffled[b * count + i];
    return values;
  }

  fs::path path_;
  std::string bytes_;
  Handle access_;
  hid_t file_ = -1;
};

// --- The columns of rooms
// ----------------------------------------------------------------------------------------------

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
  Rooms(const Reader& from, const Columns& c) : from_(from), c_(c) {}

  RoomDescription next() {
    const std::size_t r = room_++;
    RoomDescription room;
    check_name(c_.names[r]);
    room.name = c_.names[r], room.seed = c_.seeds[r], room.kind = c_.kinds[r], room.panorama = c_.panoramas[r];
    const float* shape = c_.shape.data() + 4 * r;
    room.size = {shape[0], shape[1], shape[2]}, room.panorama_turn = shape[3];
    const std::int32_t* counts = c_.counts.data() + 4 * r;
    for (int i = 0; i < counts[1]; ++i) room.materials.push_back(material());
    for (int i = 0; i < counts[2]; ++i) {
      const float* e = c_.emitters.data() + 4 * emitter_++;
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

  Material material() {
    Material m;
    std::memcpy(static_cast<void*>(&m), c_.materials.data() + kMaterialReals * material_++, sizeof m);
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
        p.emitter >= emitters || (round && (p.steps < 1 || p.steps > 4096)) ||
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
    c.check(room);
    return c;
  }

  const Reader& from_;
  const Columns& c_;
  std::size_t room_ = 0, part_ = 0, number_ = 0, material_ = 0, emitter_ = 0, camera_ = 0;
};

/// Sum over rooms of one of their four counts.
std::size_t sum_of(const Reader& from, const std::vector<std::int32_t>& values, std::size_t first, std::size_t step) {
  std::size_t sum = 0;
  for (std::size_t i = first; i < values.size(); i += step) {
    if (values[i] < 0) from.fail("a count is negative", fmt::format("{}", values[i]), "0 or more");
    sum += static_cast<std::size_t>(values[i]);
  }
  return sum;
}

Columns read_columns(const Reader& from) {
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
    if (camera.width * height != camera.height * width)
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

void write_room_file(const fs::path& path, const RoomFile& file) {
  Columns c;
  for (const RoomDescription& room : file.rooms) append(c, room);
  Writer to;
  to.column("format", std::vector<std::int32_t>{format_of(file), file.setting == Setting::HeldOut});
  to.names("name", c.names), to.names("kind", c.kinds), to.names("panorama", c.panoramas), to.names("model", c.models);
  c.each([&](const char* name, RowOf, const auto& values, std::size_t fields) {
    to.column(name, by_field(values, fields));
  });
  const std::string bytes = to.bytes();
  write_file(path, bytes + trailer_of(bytes));
}

RoomFile read_room_file(const fs::path& path) {
  const Reader from(path);
  const std::vector<std::int32_t> format = from.column<std::int32_t>("format", 2);
  if (format[0] < 1 || format[0] > kFormat)
    from.fail("of another format", fmt::format("{}", format[0]), fmt::format("1 to {}", kFormat));
  const Columns columns = read_columns(from);
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
