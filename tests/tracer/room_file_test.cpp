// Rooms in files: the same triangles, views and bytes again; damaged files; what the kinds of parts become.
#include "tracer/room_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>

#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "tests/message_of.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/generate.hpp"
#include "tracer/sky.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const fs::path kAssets = fs::path(CLERESTORY_SOURCE_DIR) / "assets";

struct RoomFiles : testing::Test {
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "clerestory-room-file-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { fs::remove_all(folder); }

  GenerateOptions small(Setting setting) const {
    GenerateOptions o;
    o.rooms.count = 2, o.views.count = 2, o.views.width = 32, o.views.height = 24, o.views.spp = 2, o.rooms.seed = 5,
    o.light.wanted = false;
    o.rooms.setting = setting, o.rooms.assets = kAssets;
    return o;
  }
  std::string error_of(const std::string& bytes) const {
    write_file(folder / "damaged.rooms", bytes);
    try {
      read_room_file(folder / "damaged.rooms");
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage) << e.what();
      EXPECT_THAT(e.what(), HasSubstr("damaged.rooms"));
      return e.what();
    }
    return "";
  }
  fs::path folder;
};

void expect_equal(const World& a, const World& b) {
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  for (std::size_t i = 0; i < a.triangles.size(); ++i) {
    const Triangle &s = a.triangles[i], &t = b.triangles[i];
    ASSERT_EQ(std::memcmp(s.v, t.v, sizeof s.v), 0) << i;
    ASSERT_EQ(std::tie(s.material, s.emitter, s.smooth), std::tie(t.material, t.emitter, t.smooth)) << i;
  }
  ASSERT_EQ(a.materials.size(), b.materials.size());
  for (std::size_t i = 0; i < a.materials.size(); ++i)
    ASSERT_EQ(std::memcmp(&a.materials[i], &b.materials[i], sizeof(Material)), 0) << i;
  ASSERT_EQ(a.emitters.size(), b.emitters.size());
  for (std::size_t i = 0; i < a.emitters.size(); ++i) {
    EXPECT_EQ(a.emitters[i].radiance, b.emitters[i].radiance);
    EXPECT_EQ(a.emitters[i].panorama, b.emitters[i].panorama);
  }
  EXPECT_EQ(a.panorama.rgb, b.panorama.rgb);
  EXPECT_EQ(a.panorama_turn, b.panorama_turn);
}

TEST_F(RoomFiles, RoomsStandAgainBitByBit) {
  for (const Setting setting : {Setting::Training, Setting::HeldOut}) {
    const RoomAssets assets = load_assets(kAssets, setting);
    RoomFile file{setting, {}};
    std::vector<Room> rooms;
    std::set<PartKind> kinds;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const Room& room = rooms.emplace_back(make_room(seed, setting, assets));
      for (const Part& part : room.parts) kinds.insert(part.kind);
      Camera camera = Camera::from_fov(32, 24, 70);
      look_at(camera, {0.1, 1.2, 0.3}, {1, 1, -1});
      file.rooms.push_back(describe_room("room", seed, room, {camera}));
    }
    EXPECT_EQ(kinds.size(), setting == Setting::Training ? 13u : 10u) << "every kind of part is among these rooms";
    write_room_file(folder / "a.rooms", file), write_room_file(folder / "b.rooms", file);
    EXPECT_EQ(read_file(folder / "a.rooms"), read_file(folder / "b.rooms"));
    const RoomFile read = read_room_file(folder / "a.rooms");
    EXPECT_EQ(read.setting, setting);
    ASSERT_EQ(read.rooms.size(), rooms.size());
    for (std::size_t i = 0; i < rooms.size(); ++i) {
      const Room again = read.rooms[i].build(assets);
      expect_equal(again.scene, rooms[i].scene);
      EXPECT_EQ(again.size, rooms[i].size);
      EXPECT_EQ(again.kind, rooms[i].kind);
      EXPECT_EQ(read.rooms[i].seed, i + 1);
      EXPECT_EQ(read.rooms[i].cameras, file.rooms[i].cameras);
    }
  }
}

// Rooms of a file have its names, which are looked for before anything is written.
TEST_F(RoomFiles, AnotherDataSetIsNotWrittenOver) {
  GenerateOptions made = small(Setting::Training);
  RoomFile rooms = describe_rooms(test_device(), made);
  rooms.rooms[0].name = "room-of-a-file";
  write_room_file(folder / "rooms.rooms", rooms);
  made.out = folder / "theirs", made.rooms.from = folder / "rooms.rooms";
  std::filesystem::create_directories(folder / "theirs/room-of-a-file");
  write_file(folder / "theirs/room-of-a-file/000_im.exr", "of somebody else");
  EXPECT_THAT(message_of<Error>([&] { generate(test_device(), made); }),
              AllOf(HasSubstr("another data set"), HasSubstr("room-of-a-file")));
  EXPECT_EQ(read_file(folder / "theirs/room-of-a-file/000_im.exr"), "of somebody else");
}

TEST_F(RoomFiles, DataOfAFileIsThatOfTheRules) {
  for (const Setting setting : {Setting::Training, Setting::HeldOut}) {
    GenerateOptions made = small(setting), again = made;
    write_room_file(folder / "rooms.rooms", describe_rooms(test_device(), made));
    made.out = folder / "made", again.out = folder / "again";
    again.rooms.from = folder / "rooms.rooms", again.rooms.seed = 77,
    again.rooms.setting = Setting::Training;  // no say
    generate(test_device(), made), generate(test_device(), again);
    int pictures = 0;
    for (const auto& entry : fs::recursive_directory_iterator(made.out)) {
      const fs::path name = fs::relative(entry.path(), made.out);
      if (!entry.is_regular_file() || name == "generate.json") continue;
      EXPECT_EQ(read_file(entry.path(), 1 << 28, true), read_file(again.out / name, 1 << 28, true)) << name;
      pictures += name.extension() == ".exr";
    }
    EXPECT_GE(pictures, 4 * 6);
    // The folder belongs to this file of rooms: another one's views do not go in between.
    again.rooms.count = 1;
    write_room_file(folder / "rooms.rooms", describe_rooms(test_device(), small(Setting::Training)));
    if (setting == Setting::HeldOut) {
      EXPECT_THROW(generate(test_device(), again), Error);
    }
    fs::remove_all(made.out), fs::remove_all(again.out);
  }
}

// The lists that come with the program, and what docs/commands.md says of them.
TEST_F(RoomFiles, ShippedListsStand) {
  struct List {
    const char* name;
    Setting setting;
    std::size_t rooms;
  };
  for (const List& list : {List{"judge_training", Setting::Training, 200},
                           {"judge_held_out", Setting::HeldOut, 100},
                           {"judge_seen", Setting::Training, 64},
                           {"judge_training_3", Setting::Training, 32}}) {
    const RoomFile file =
        read_room_file(fs::path(CLERESTORY_SOURCE_DIR) / "experiments/rooms" / (std::string(list.name) + ".rooms"));
    EXPECT_EQ(file.setting, list.setting) << list.name;
    ASSERT_EQ(file.rooms.size(), list.rooms) << list.name;
    const RoomAssets assets = load_assets(kAssets, list.setting);
    std::set<std::uint64_t> seeds;
    for (const RoomDescription& room : file.rooms) {
      EXPECT_EQ(room.cameras.size(), 2u) << room.name;
      EXPECT_GT(room.build(assets).scene.triangles.size(), 500u) << room.name;
      seeds.insert(room.seed);
    }
    EXPECT_EQ(seeds.size(), list.rooms) << "each room once";
  }
}

// Programs of before read what they can, and no more.
TEST_F(RoomFiles, TheFormatIsTheOldestThatHoldsTheRooms) {
  const auto format = [&](auto change) {
    RoomDescription room;
    room.name = "room", room.kind = "box", room.size = {1, 1, 1};
    room.materials.resize(1);
    room.parts.push_back({.kind = PartKind::Sphere, .numbers = {0, 0, 0, 1}, .steps = 4});
    change(room);
    const RoomFile file{Setting::Training, {room}};
    write_room_file(folder / "rooms.rooms", file);
    EXPECT_EQ(format_of(read_room_file(folder / "rooms.rooms")), format_of(file));
    return format_of(file);
  };
  EXPECT_EQ(format([](RoomDescription& r) { r.materials[0].noise = 0.1f; }), 1);
  EXPECT_EQ(format([](RoomDescription& r) { r.materials[0].texture = static_cast<float>(Texture::Print); }), 2);
  EXPECT_EQ(format([](RoomDescription& r) { r.panorama = sunny_name(1); }), 2);
  EXPECT_EQ(format([](RoomDescription& r) { r.panorama = sky_name(1); }), 1);
  EXPECT_EQ(format([](RoomDescription& r) { r.materials[0].smudge = -0.1f; }), 2);
  EXPECT_EQ(format([](RoomDescription& r) { r.materials[0].stain = 0.1f; }), 2);
  EXPECT_EQ(format([](RoomDescription& r) {
              r.parts[0].kind = PartKind::Blob, r.parts[0].numbers = {0, 0, 0, 1, 1, 1, 0, 1, 7};
            }),
            2);
}

TEST_F(RoomFiles, AFileIsAskedForNoMoreThanItHas) {
  const GenerateOptions made = small(Setting::Training);
  write_room_file(folder / "rooms.rooms", describe_rooms(test_device(), made));
  const auto message = [&](auto change) {
    GenerateOptions o = made;
    o.out = folder / "out", o.rooms.from = folder / "rooms.rooms";
    change(o);
    try {
      generate(test_device(), o);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      EXPECT_FALSE(fs::exists(o.out)) << "nothing is begun";
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(message([](GenerateOptions& o) { o.rooms.count = 3; }), HasSubstr("fewer rooms"));
  EXPECT_THAT(message([](GenerateOptions& o) { o.views.count = 3; }), HasSubstr("fewer views"));
  EXPECT_THAT(message([](GenerateOptions& o) { o.views.width = 40; }), HasSubstr("another shape"));
  EXPECT_THAT(message([&](GenerateOptions& o) { o.rooms.from = folder / "none.rooms"; }), HasSubstr("none.rooms"));
  EXPECT_EQ(message([](GenerateOptions& o) { o.views.width = 64, o.views.height = 48; }), "")
      << "the same view, larger";
}

TEST_F(RoomFiles, DamageIsFoundAndNamed) {
  write_room_file(folder / "rooms.rooms", describe_rooms(test_device(), small(Setting::Training)));
  const std::string whole = read_file(folder / "rooms.rooms");
  EXPECT_EQ(error_of(whole), "");
  EXPECT_THAT(error_of("no rooms at all"), HasSubstr("another file"));
  for (const std::size_t size : {whole.size() - 1, whole.size() / 2, std::size_t{100}})
    EXPECT_NE(error_of(whole.substr(0, size)), "") << size;
  for (std::size_t at = 0; at < whole.size(); at += 61) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    EXPECT_NE(error_of(bytes), "") << at;
  }
}

TEST_F(RoomFiles, NumbersThatMeanNothingAreRefused) {
  const RoomFile whole = describe_rooms(test_device(), small(Setting::Training));
  const auto error_with = [&](const std::function<void(RoomDescription&)>& change) {
    RoomFile other = whole;
    change(other.rooms.at(0));
    write_room_file(folder / "other.rooms", other);
    return error_of(read_file(folder / "other.rooms"));
  };
  EXPECT_EQ(error_with([](RoomDescription&) {}), "");
  for (const float texture : {11.0f, -1.0f, 0.5f})
    EXPECT_THAT(error_with([&](RoomDescription& room) { room.materials.at(0).texture = texture; }),
                HasSubstr("texture"))
        << texture;
  EXPECT_THAT(error_with([](RoomDescription& room) { room.emitters.at(0).radiance.y = -1; }), HasSubstr("lamp"));
}

TEST_F(RoomFiles, AssetsThatAreMissingAreNamed) {
  const RoomAssets held_out = load_assets(kAssets, Setting::HeldOut);
  const Room room = make_room(1, Setting::HeldOut, held_out);
  const RoomDescription description = describe_room("its name", 1, room, {});
  RoomAssets less = held_out;
  less.models.clear();
  for (const RoomAssets& assets : {load_assets(kAssets, Setting::Training), less}) try {
      description.build(assets);
      ADD_FAILURE();
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr("its name"));
    }
}

// Lists of rooms that judge are files of parts: what a kind becomes must stay. Number of triangles, and sums over their
// corners of place, texture coordinates and normal, each times the corner's index, so that their order counts; as they
// were when such files began. Another C library may round sines otherwise.
TEST(Parts, BecomeTheTrianglesTheyAlwaysBecame) {
  struct Case {
    Part part;
    std::size_t triangles;
    double sum;
  };
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  mesh.normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  mesh.indices = {{0, 1, 2}, {0, 2, 3}};
  const auto part = [](PartKind kind, std::vector<float> numbers, int steps = 0, bool open = false) {
    Part p{.kind = kind, .numbers = std::move(numbers), .steps = steps, .open = open};
    p.to_room[0] = {0, 0, -1, 0}, p.to_room[2] = {1, 0, 0, 0}, p.to_room[3] = {0.5f, 0.25f, -2, 1};
    p.shift = {1.5f, -0.75f, 0.125f};
    return p;
  };
  for (const Case& c : {
           Case{part(PartKind::Quad, {0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0, 0.5f, 0.25f}), 2, -3.26096},
           Case{part(PartKind::Canvas, {0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0}), 2, -4.15167},
           Case{part(PartKind::Box, {-1, 0, -2, 1, 3, 2}), 12, -43.74906},
           Case{part(PartKind::Cushion, {-1, 0, -2, 1, 3, 2, 0.25f}, 3), 588, -9.49584},
           Case{part(PartKind::Lathe, {0, 1, 0, 0.5f, 0, 0.75f, 0.5f, 0.25f, 1}, 20), 120, 23.28962},
           Case{part(PartKind::Lathe, {0, 1, 0, 0.5f, 0, 0.75f, 0.5f, 0.25f, 1}, 20, true), 80, 21.43105},
           Case{part(PartKind::Disc, {0, 1, 0, 0.5f}, 20), 20, -9.63646},
           Case{part(PartKind::Sphere, {0, 1, 0, 0.5f}, 12), 528, 44.98121},
           Case{part(PartKind::Mesh, {0, 1, 0, 0.5f}), 2, -1.64464},
           Case{part(PartKind::Curtain, {0, 1, 0, 2, 1.5f, 0.1f}, 5), 80, 4.27802},
           Case{part(PartKind::Tube, {0.1f, 0, 0, 0, 0, 1, 0, 0.5f, 1, 0}, 8), 48, -3.35132},
           Case{part(PartKind::Turned, {0, 1, 0, 0.5f, 0, 0.75f, 0.5f, 0.25f, 1}, 20), 120, 24.56202},
           Case{part(PartKind::Blob, {0, 1, 0, 0.5f, 0.25f, 0.75f, 0.4f, 2, 77}, 12), 528, 37.03400},
           Case{part(PartKind::Cloth, {0, 1, 0, 0.5f, 0.75f, 0.125f, 77}, 6), 72, -7.96391},
       }) {
    World world;
    add_part(world, c.part, &mesh);
    double sum = 0, index = 0;
    for (const Triangle& t : world.triangles)
      for (const Vertex& v : t.v) {
        ++index;
        const glm::vec3 all = v.position + 0.5f * v.uvw + 0.25f * v.normal;
        sum += std::sin(index) * static_cast<double>(all.x + 2 * all.y + 4 * all.z);
      }
    EXPECT_EQ(world.triangles.size(), c.triangles) << static_cast<int>(c.part.kind);
    // Up to 1764 terms of up to 7, a rounding each: 2e-5 as random walks go.
    EXPECT_NEAR(sum, c.sum, 1e-4) << static_cast<int>(c.part.kind);
  }
}

}  // namespace
}  // namespace clerestory
