// Lists of rooms: what they say, what is refused, and that what judges was not what was chosen on.
#include "experiments/studies/room_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/experiments/synthetic_views.hpp"

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
