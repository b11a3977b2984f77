// Generated rooms as other data sets: read again by their readers, and judged by their protocols.
#include "experiments/evaluation/layouts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/evaluation/whdr.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/light_files.hpp"
#include "host/io/nyu.hpp"
#include "host/io/openrooms.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int width = 64, height = 48;

struct Layouts : testing::Test {
  ScratchFolder folder{"clerestory-layouts"};
  const fs::path& rooms = folder.path();

  void SetUp() override {
    write_synthetic_rooms(rooms, "train", 2, 2, width, height, 3);
    write_synthetic_rooms(rooms, "test", 1, 2, width, height, 4);
  }
  RoomView view(const std::string& room, const std::string& id) const { return read_view(rooms / room, id); }
};

TEST_F(Layouts, TheTrueAlbedoOfIiwAgreesWithItsJudgementsByBothConventions) {
  write_layout(rooms, "iiw");
  const std::vector<IiwPicture> all = list_iiw(rooms / "iiw");
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0].id, "test_room_0_000");
  const Image albedo = view("test_room_0", "000").albedo;
  const Judgements judgements = read_judgements(all[0].judgements);
  const auto linear = whdr(albedo, judgements), shown = whdr(display_coded(albedo), judgements);
  ASSERT_TRUE(linear && shown);
  EXPECT_EQ(linear->rate, 0);
  EXPECT_EQ(shown->rate, 0);
  EXPECT_GT(linear->counted, 60);
  EXPECT_GT(whdr(Image(4, 4, 3, 0.5f), judgements)->rate, 0) << "and not everything is equal";
  const Image picture = read_photo(all[0].picture).image;
  EXPECT_EQ(picture.width, width);
  EXPECT_NEAR(picture.at(1, 40, 9), view("test_room_0", "000").image.at(1, 40, 9), 0.01);
}

TEST_F(Layouts, JudgementsKeepOffWhatIsNotUsable) {
  Image albedo(40, 30, 3, 0.5f), usable(40, 30, 1);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 20; ++x) usable.at(0, y, x) = 1;
  const Judgements j = judgements_of(albedo, usable, 7);
  ASSERT_GT(j.points.size(), 20u);
  for (const JudgedPoint& p : j.points) EXPECT_LT(p.x, 0.5);
  EXPECT_EQ(judgements_of(albedo, usable, 7).points[3].x, j.points[3].x);
  EXPECT_TRUE(judgements_of(albedo, Image(40, 30, 1), 7).points.empty());
  for (int y = 0; y < 30; ++y)  // 20 % apart: darker of linear values, equal of display values
    for (int x = 0; x < 20; x += 2)
      for (int c = 0; c < 3; ++c) albedo.at(c, y, x) = 0.6f;
  int undecided = 0;
  for (const JudgedPair& one : judgements_of(albedo, usable, 7).comparisons) undecided += !one.darker;
  EXPECT_GT(undecided, 5);
}

TEST_F(Layouts, NyuIsTheSameMapsByNumber) {
  write_layout(rooms, "nyu");
  const NyuFile file(rooms / "nyu" / kNyuFile);
  ASSERT_EQ(file.size(), 6);
  EXPECT_EQ(read_file(rooms / "nyu/test.txt"), "0005.png\n0006.png\n");
  EXPECT_EQ(read_file(rooms / "nyu/train.txt"), "0001.png\n0002.png\n0003.png\n0004.png\n");
  const RoomView truth = view("test_room_0", "001");
  EXPECT_EQ(file.depth(6).data, truth.depth.data);
  EXPECT_NEAR(file.picture(6).at(2, 40, 9), truth.image.at(2, 40, 9), 0.01);
  const Benchmark benchmark = nyu_benchmark(Protocol::Zhu, rooms / "nyu", {rooms / "nyu/test.txt", ""});
  const BenchmarkResult result = run_benchmark(benchmark, [&](std::size_t i) {
    const RoomView predicted = view("test_room_0", view_id(static_cast<int>(i)));
    return PredictedMaps{.normal = predicted.normal, .depth = predicted.depth};
  });
  for (std::size_t m = 0; m < 4; ++m) {
    ASSERT_EQ(result.figures[m].size(), 2u) << result.metrics[m].key;
    EXPECT_NEAR(result.figures[m][1], 0, m < 2 ? 0.5 : 1e-6) << result.metrics[m].key << " (normals of 8 bits)";
  }
}

TEST_F(Layouts, OpenRoomsIsTheSameMapsAndLight) {
  const RoomView truth = view("test_room_0", "001");
  Envmaps light{EnvmapLayout::of(width, height), {}};
  light.radiance = Image(light.layout.file_width(), light.layout.file_height(), 3);
  for (std::size_t i = 0; i < light.radiance.data.size(); ++i) light.radiance.data[i] = static_cast<float>(i % 31);
  write_envmaps(rooms / "test_room_0", "001", light);
  write_layout(rooms, "openrooms");
  EXPECT_EQ(layout_of(rooms / "openrooms"), DataLayout::OpenRooms);
  const std::vector<OpenRoomsName> test = list_openrooms(rooms / "openrooms", "test");
  ASSERT_EQ(test.size(), 2u);
  EXPECT_EQ(list_openrooms(rooms / "openrooms", "train").size(), 4u);
  EXPECT_EQ(test[1].text(), "main_xml/test_room_0/2");
  const OpenRoomsView read = read_openrooms(test[1]);
  EXPECT_EQ(read.depth.data, truth.depth.data);
  EXPECT_EQ(read.mask.at(0, 0, width - 1), 0.5f) << "the corner emits";
  EXPECT_EQ(read.mask.at(0, 9, 9), 1);
  EXPECT_NEAR(read.albedo.at(1, 9, 9), truth.albedo.at(1, 9, 9), 0.01);
  EXPECT_NEAR(read.image.at(1, 9, 9), truth.image.at(1, 9, 9), 0.02);
  ASSERT_TRUE(read.light);
  EXPECT_FALSE(read_openrooms(test[0]).light);
  // the tile of pixel (4 * 9 + 2, 4 * 5 + 2) is that of our point there; its texel (7, 3) those of (14..15, 6..7)
  const int column = light.layout.columns * 38 / width, row = light.layout.rows * 22 / height;
  for (const auto& [x, y] : {std::pair{14, 6}, {15, 7}})
    EXPECT_NEAR(read.light->at(0, 5 * 16 + y, 9 * 32 + x), light.at(column, row, 7, 3)[0], 31 / 128.0);
}

TEST_F(Layouts, OpenRoomsIsJudgedByLiAndMarigold) {
  write_layout(rooms, "openrooms");
  const fs::path data = rooms / "openrooms";
  const auto predict = [&](std::size_t i) {
    const RoomView v = view("test_room_0", view_id(static_cast<int>(i)));
    return PredictedMaps{v.albedo, v.normal, v.depth, v.material};
  };
  const BenchmarkResult li = run_benchmark(openrooms_benchmark(Protocol::Li, data, {}), predict);
  for (std::size_t m = 0; m < li.metrics.size(); ++m) EXPECT_LT(li.figures[m].at(1), 1e-4) << li.metrics[m].key;
  const BenchmarkResult marigold = run_benchmark(openrooms_benchmark(Protocol::Marigold, data, {}), predict);
  EXPECT_GT(marigold.figures[0].at(0), 45) << "8 bits";
  EXPECT_THROW(openrooms_benchmark(Protocol::Zhu, data, {}), Error);
  EXPECT_THROW(openrooms_benchmark(Protocol::Li, data, {"list.txt", ""}), Error);
}

TEST_F(Layouts, NothingIsReplacedAndNothingIsHalfThere) {
  write_layout(rooms, "iiw");
  try {
    write_layout(rooms, "iiw");
    FAIL() << "written over";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("iiw: is there already"));
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
  }
  const auto interrupted = [](int done, int) {
    if (done == 3) throw Error(ErrorKind::Interrupted, "stopped");
  };
  EXPECT_THROW(write_layout(rooms, "nyu", interrupted), Error);
  EXPECT_FALSE(fs::exists(rooms / "nyu"));
  EXPECT_THROW(write_layout(folder / "none", "nyu"), Error);
}

}  // namespace
}  // namespace clerestory
