// Rooms made on the way: which view stands where, what a second run finds, what is dropped; and pictures seen through
// cameras.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "experiments/training/photo.hpp"
#include "experiments/training/training_views.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/roundings.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct RoomStreamTest : testing::Test {
  ScratchFolder folder{"clerestory-room-stream"};
  void SetUp() override { set_quiet(true); }
  void TearDown() override { set_quiet(false); }

  StreamOptions options(const std::string& name) const {
    StreamOptions o;
    o.on = true, o.times = 3, o.window = 2;
    GenerateOptions& rooms = o.rooms;
    rooms.out = folder / name, rooms.rooms.seed = 4, rooms.views.count = 2, rooms.views.width = 24,
    rooms.views.height = 16, rooms.views.spp = 1;
    rooms.light.wanted = false, rooms.rooms.boxes = true;
    return o;
  }
  static std::string place(const ViewName& name) { return name.room.filename().string() + "/" + name.id; }
  std::set<std::string> rooms_in(const std::string& name) const {
    std::set<std::string> rooms;
    for (const auto& entry : fs::directory_iterator(folder / name)) rooms.insert(entry.path().filename().string());
    return rooms;
  }
};

TEST_F(RoomStreamTest, ViewsComeFromAWindowThatMovesOnAndAreSeenAsOftenAsSaid) {
  RoomStream stream(options("a"), 7, 0);
  std::map<int, int> seen;
  for (std::uint64_t position = 0; position < 90; ++position) {
    const ViewName name = stream.at(position);
    const std::string room = name.room.filename().string();
    const int index = std::stoi(room.substr(room.size() - 5));
    EXPECT_GE(index, static_cast<int>(position / 6)) << position;
    EXPECT_LT(index, static_cast<int>(position / 6) + 2) << position;
    EXPECT_TRUE(fs::exists(view_file(name.room, name.id, "im"))) << position;
    ++seen[index];
  }
  EXPECT_EQ(stream.rooms(89), 16);
  // Of rooms 1 to 13, all of whose time is over, each of two views is seen 3 times: a binomial count of mean 78 over
  // 90 draws has a deviation below 4.
  int whole = 0;
  for (int room = 1; room < 14; ++room) whole += seen[room];
  EXPECT_NEAR(whole, 78, 4 * 4);
}

TEST_F(RoomStreamTest, FromAnyPositionTheSameViewsOfTheSameBits) {
  RoomStream whole(options("whole"), 7, 0);
  std::vector<ViewName> first;
  for (std::uint64_t position = 0; position < 40; ++position) first.push_back(whole.at(position));
  RoomStream later(options("later"), 7, 35);
  for (std::uint64_t position = 35; position < 40; ++position) {
    const ViewName name = later.at(position);
    EXPECT_EQ(place(name), place(first[position]));
    for (const char* map : {"im", "depth", "albedo"})
      EXPECT_EQ(read_file(view_file(name.room, name.id, map)),
                read_file(view_file(first[position].room, first[position].id, map)));
  }
  RoomStream other(options("other"), 8, 35);
  int same = 0;
  for (std::uint64_t position = 35; position < 60; ++position)
    same += place(other.at(position)) == place(whole.at(position));
  EXPECT_LT(same, 20);  // another order
}

TEST_F(RoomStreamTest, ManyMakersMakeTheRoomsOfOne) {
  RoomStream one(options("one"), 7, 0);
  StreamOptions o = options("many");
  o.makers = 3, o.unread = 4;
  RoomStream many(o, 7, 0);
  for (std::uint64_t position = 0; position < 60; ++position) {
    const ViewName a = one.at(position), b = many.at(position);
    EXPECT_EQ(place(a), place(b)) << position;
    for (const char* map : {"im", "depth", "normal", "material"})
      EXPECT_EQ(read_file(view_file(a.room, a.id, map)), read_file(view_file(b.room, b.id, map))) << position << map;
  }
}

TEST_F(RoomStreamTest, WhatIsOverIsDropped) {
  {
    RoomStream stream(options("a"), 7, 0);
    for (std::uint64_t position = 0; position < 120; ++position) stream.at(position);
  }
  const std::set<std::string> rooms = rooms_in("a");
  EXPECT_LE(rooms.size(), 2u * 3 + 4 + 1);  // the window, two behind it, and what is made ahead
  EXPECT_EQ(rooms.count("room-s4-00000"), 0u);
  EXPECT_EQ(rooms.count("room-s4-00020"), 1u);
}

TEST_F(RoomStreamTest, WhatAnEarlierTryKeptIsDropped) {
  {
    RoomStream stream(options("a"), 7, 0);
    for (std::uint64_t position = 0; position < 60; ++position) stream.at(position);
  }
  ASSERT_EQ(rooms_in("a").count("room-s4-00008"), 1u);
  RoomStream stream(options("a"), 7, 108);
  stream.at(108);
  EXPECT_EQ(rooms_in("a").count("room-s4-00008"), 0u);
  EXPECT_EQ(rooms_in("a").count("room-s4-00018"), 1u);
}

TEST_F(RoomStreamTest, RoomsThatAreJudgedAreNotMade) {
  const StreamOptions o = options("a");
  const auto judged = [&](const std::string& room) { check_not_streamed(o, {{folder / room, "000"}}); };
  EXPECT_NO_THROW(judged("room-s41-00000"));
  EXPECT_NO_THROW(judged("held-out-room-s4-00000"));
  EXPECT_NO_THROW(check_not_streamed({}, {{folder / "room-s4-00000", "000"}})) << "without a stream";
  try {
    judged("room-s4-00123");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    for (const char* word : {"stream.seed", "4", "room-s4-00123"})
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST_F(RoomStreamTest, WhatCannotBeMadeEndsTheStreamWithItsReason) {
  StreamOptions o = options("a");
  o.rooms.views.spp = 0;
  EXPECT_THROW(RoomStream(o, 7, 0), Error);
  write_file(folder / "file", "no folder");
  o = options("file");
  RoomStream stream(o, 7, 0);
  EXPECT_THROW(stream.at(0), Error);
}

TEST_F(RoomStreamTest, ViewsAreCutToTheirMiddleAndMixedWithFixedOnes) {
  write_synthetic_rooms(folder / "fixed", "train", 1, 2, 24, 16, 3);
  ViewStore fixed(name_views({(folder / "fixed").string()}, "train"), 12, 8, 0);
  StreamOptions o = options("a");
  o.fixed = 0.5, o.crop_low = 0.5;
  const auto views = streamed_views(o, {12, 8}, &fixed, 7, 0);
  int from_fixed = 0;
  for (std::uint64_t position = 0; position < 64; ++position) {
    const NamedView view = views->at(position)();
    EXPECT_EQ(view.view.image.width, 12);
    EXPECT_EQ(view.view.truth.depth.height, 8);
    from_fixed += view.name.find("/fixed/") != std::string::npos;
  }
  EXPECT_NEAR(from_fixed, 32, 4 * std::sqrt(64 * 0.5 * 0.5));
  const RoomView raw = read_view(fixed.name(0).room, fixed.name(0).id);
  const RoomView middle = centre_of(raw, 12, 8);
  EXPECT_EQ(middle.image.at(1, 3, 5), raw.image.at(1, 7, 11));
  EXPECT_EQ(middle.normal.at(2, 0, 0), raw.normal.at(2, 4, 6));
  RoomView seen = raw;
  seen.camera = Camera::from_fov(24, 16, 60);
  EXPECT_EQ(centre_of(seen, 12, 8).camera->cx, seen.camera->cx - 6);
  EXPECT_EQ(centre_of(seen, 12, 8).camera->fx, seen.camera->fx);
}

Image gradient(int width, int height) {
  Image image(width, height, 3);
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        image.at(c, y, x) = 0.02f + 2.5f * static_cast<float>(x) / static_cast<float>(width);
  return image;
}

TEST(Photo, IsAFunctionOfItsKeyWithTheNetsExposure) {
  const Image picture = gradient(40, 30);
  const Image one = as_photographed(picture, 1), again = as_photographed(picture, 1),
              other = as_photographed(picture, 2);
  EXPECT_EQ(one.data, again.data);
  EXPECT_NE(one.data, other.data);
  for (std::uint64_t key = 0; key < 20; ++key) {
    const Image photo = as_photographed(picture, key);
    EXPECT_NEAR(luminance_quantile(photo.data, 0.95), 0.9, 0.9 * 8 * kFloatRounding);
    for (const float v : photo.data) ASSERT_TRUE(std::isfinite(v) && v >= 0) << key;
  }
}

TEST(Photo, ExposureOfTheSceneDoesNotMatterAndBrightStaysBrighter) {
  const Image picture = gradient(40, 30);
  Image brighter = picture;
  for (float& v : brighter.data) v *= 8;  // exact
  for (std::uint64_t key = 0; key < 5; ++key) {
    const Image photo = as_photographed(picture, key), same = as_photographed(brighter, key);
    double worst = 0;
    for (std::size_t i = 0; i < photo.data.size(); ++i)
      worst = worse(worst, std::abs(static_cast<double>(photo.data[i]) - static_cast<double>(same.data[i])));
    EXPECT_LT(worst, 0.03) << key;  // a step of the eight bits at most
    // Columns: a tone curve and tints keep the order; noise averages out over 30 rows.
    const auto column = [&](int x) {
      double sum = 0;
      for (int c = 0; c < 3; ++c)
        for (int y = 0; y < 30; ++y) sum += static_cast<double>(photo.at(c, y, x));
      return sum;
    };
    EXPECT_LT(column(2), column(10)) << key;
    EXPECT_LT(column(10), column(20)) << key;
  }
}

// Noise and focus alone do not make blocks: pictures differ from cells of 8x8 to cells more than within them.
TEST(Photo, IsAJpeg) {
  double across = 0, within = 0;
  for (std::uint64_t key = 0; key < 40; ++key) {
    const Image photo = as_photographed(gradient(128, 96), key);
    for (int y = 0; y < photo.height; ++y)
      for (int x = 1; x + 1 < photo.width; ++x) {
        const double bend =
            std::abs(2.0 * static_cast<double>(photo.at(1, y, x)) - static_cast<double>(photo.at(1, y, x - 1)) -
                     static_cast<double>(photo.at(1, y, x + 1)));
        if (x % 8 == 0 || x % 8 == 7) across += bend / 2;
        if (x % 8 == 3 || x % 8 == 4) within += bend / 2;
      }
  }
  EXPECT_GT(across, 1.05 * within);
}

TEST(Photo, OfABlackPictureIsFinite) {
  const Image photo = as_photographed(Image(8, 6, 3), 5);
  for (const float v : photo.data) EXPECT_TRUE(std::isfinite(v) && v >= 0);
}

}  // namespace
}  // namespace clerestory
