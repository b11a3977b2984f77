// Lists of rooms: what they say, what is refused, and that what judges was not what was chosen on.
#include "experiments/truth/room_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

fs::path list(const char* name) { return fs::path(CLERESTORY_SOURCE_DIR) / "experiments/rooms" / name; }

TEST(RoomList, JudgesAreHeldOutAndApartFromWhatIsChosenOn) {
  const RoomList judged = read_room_list(list("judged.txt")), validation = read_room_list(list("validation.txt"));
  EXPECT_EQ(judged.setting, Setting::HeldOut);
  EXPECT_EQ(validation.setting, Setting::Training) << "held-out content is for judging alone";
  std::set<std::uint64_t> all(judged.seeds.begin(), judged.seeds.end());
  all.insert(validation.seeds.begin(), validation.seeds.end());
  EXPECT_EQ(all.size(), judged.seeds.size() + validation.seeds.size());
  EXPECT_GE(judged.seeds.size(), 32u);
}

TEST(RoomList, GivesItsFirstRoomsOrADraw) {
  const RoomList whole = read_room_list(list("judged.txt"));
  const RoomList first = rooms_of(whole, 3, 0), drawn = rooms_of(whole, 32, 7);
  EXPECT_THAT(first.seeds, testing::ElementsAre(whole.seeds[0], whole.seeds[1], whole.seeds[2]));
  EXPECT_EQ(std::set(drawn.seeds.begin(), drawn.seeds.end()).size(), 32u) << "a room twice";
  EXPECT_EQ(drawn.seeds, rooms_of(whole, 32, 7).seeds);
  EXPECT_NE(drawn.seeds, rooms_of(whole, 32, 8).seeds);
  EXPECT_THROW(rooms_of(whole, whole.seeds.size() + 1, 0), Error);
}

// What the rules make of these seeds may change; what a study sees of them must not. Triangles, materials, lamps and
// cameras of a few rooms, as they were when the lists were described.
TEST(RoomList, RoomsStayWhatTheyWere) {
  struct Case {
    const char* name;
    std::size_t triangles, materials;
    double corners, eye;
  };
  for (const Case& c : {Case{"judged.txt", 2099998, 3257, 4071633.1449, 39514.3376},
                        Case{"validation.txt", 970170, 4071, 1173526.2483, 38580.5151}}) {
    const RoomList rooms = read_room_list(list(c.name));
    ASSERT_EQ(rooms.described.filename(), fs::path(c.name).replace_extension(".rooms"));
    const RoomFile file = read_room_file(rooms.described);
    EXPECT_EQ(file.setting, rooms.setting);
    const RoomFile all = rooms_of_seeds(file, rooms.seeds, c.name);
    const RoomAssets assets = load_assets(default_assets(), rooms.setting);
    std::size_t triangles = 0, materials = 0;
    double corners = 0, eye = 0;
    for (const RoomDescription& described : all.rooms) {
      const ListedRoom listed{0, described.seed, rooms.setting, assets, &described};
      const Room room = listed.make();
      triangles += room.scene.triangles.size(), materials += room.scene.materials.size();
      for (const Triangle& t : room.scene.triangles) {
        const glm::dvec3 p(t.v[1].position);
        corners += p.x + 2 * p.y + 4 * p.z;
      }
      for (const Camera& camera : described.views(5, 160, 120)) eye += camera.fx + glm::length(camera.position());
    }
    EXPECT_EQ(triangles, c.triangles) << c.name;
    EXPECT_EQ(materials, c.materials) << c.name;
    // 1e-6: another C library may round sines otherwise.
    EXPECT_NEAR(corners, c.corners, 1e-6 * std::abs(c.corners)) << c.name;
    EXPECT_NEAR(eye, c.eye, 1e-6 * c.eye) << c.name;
  }
}

TEST(RoomList, AFileThatLacksARoomIsNamed) {
  const RoomList rooms = read_room_list(list("judged.txt"));
  const RoomFile file = read_room_file(rooms.described);
  try {
    rooms_of_seeds(file, {rooms.seeds[1], 5}, "these rooms");
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_THAT(e.what(), testing::AllOf(testing::HasSubstr("these rooms"), testing::HasSubstr("5")));
  }
  EXPECT_EQ(rooms_of_seeds(file, {rooms.seeds[1]}, "").rooms.at(0).seed, rooms.seeds[1]);
  EXPECT_THROW(file.rooms[0].views(6, 160, 120), Error);
  EXPECT_THROW(file.rooms[0].views(1, 160, 160), Error);
}

TEST(RoomList, RefusesWhatIsNone) {
  const ScratchFolder folder("room-list");
  const auto said = [&](const std::string& text) -> std::string {
    write_file(folder / "rooms.txt", text);
    try {
      read_room_list(folder / "rooms.txt");
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      return e.what();
    }
    return "nothing";
  };
  EXPECT_EQ(said("# two rooms\nsetting training\n\n1 # the first\n2\n"), "nothing");
  EXPECT_THAT(said("1\n2\n"), testing::HasSubstr("no setting"));
  EXPECT_THAT(said("setting somewhere\n1\n"), testing::HasSubstr("rooms.txt:1"));
  EXPECT_THAT(said("setting training\n1\n-2\n"), testing::HasSubstr("rooms.txt:3"));
  EXPECT_THAT(said("setting training\n1\n1\n"), testing::HasSubstr("twice"));
  EXPECT_THAT(said("setting training\n1 2\n"), testing::HasSubstr("more than one"));
  EXPECT_THROW(read_room_list(folder / "nothing.txt"), Error);
}

}  // namespace
}  // namespace clerestory
