// The data set on disk: layout, units, resume, shards, seeds.
#include "tracer/generate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/light_files.hpp"
#include "host/math/statistics.hpp"
#include "tests/message_of.hpp"
#include "tests/tracer/scenes.hpp"
#include "tracer/envmaps.hpp"
#include "tracer/probes.hpp"
#include "tracer/room.hpp"
#include "tracer/stereo.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

class Generate : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "clerestory-generate-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
  }
  void TearDown() override { fs::remove_all(root_); }

  GenerateOptions small(const std::string& folder, std::uint64_t seed = 3) const {
    GenerateOptions o;
    o.out = root_ / folder, o.rooms.count = 2, o.views.count = 2, o.views.width = 32, o.views.height = 24,
    o.views.spp = 8, o.rooms.seed = seed;
    o.light.wanted = false, o.light.spp = 1, o.light.probes = 2;  // these samples where a test asks for light
    o.rooms.assets = std::string(CLERESTORY_SOURCE_DIR) + "/assets";
    return o;
  }
  /// Name relative to the data set -> bytes.
  static std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file())
        all[fs::relative(entry.path(), folder).string()] = read_file(entry.path(), 1 << 28, true);
    }
    return all;
  }
  fs::path root_;
};

TEST_F(Generate, LayoutAndUnits) {
  GenerateOptions o = small("a");
  o.balls = true;
  const GenerateSummary summary = generate(test_device(), o);
  EXPECT_EQ(summary.made, 4);
  EXPECT_EQ(summary.dropped, 0) << summary.first_dropped;
  const std::vector<std::string> rooms = list_rooms(o.out, "train");
  ASSERT_EQ(rooms.size(), 2u);
  EXPECT_EQ(list_views(o.out / rooms[0]), (std::vector<std::string>{"000", "001"}));
  int with_balls = 0;
  for (const std::string& name : rooms) {
    for (const std::string id : {"000", "001"}) {
      const fs::path room = o.out / name;
      for (const char* what : {"im", "mask", "albedo", "depth", "material", "normal", "emission", "variance"}) {
        EXPECT_TRUE(fs::exists(view_file(room, id, what))) << what;
      }
      const Image millimetres = read_image(view_file(room, id, "depth"));
      const RoomView view = read_view(room, id);
      EXPECT_EQ(view.image.width, 32);
      EXPECT_EQ(view.image.height, 24);
      ASSERT_TRUE(view.camera);
      for (std::size_t i = 0; i < view.depth.pixels(); ++i) {
        EXPECT_EQ(view.mask.data[i], 1);
        EXPECT_GT(millimetres.data[i], 100);  // nothing is nearer than 10 cm, nothing farther than 10 m
        EXPECT_LT(millimetres.data[i], 10000);
      }
      EXPECT_NEAR(exposure_of(view.image.data), 1, 0x1p-10) << "stored in half precision";
      const CameraFile camera = read_camera(view_file(room, id, "camera", "json"));
      ASSERT_TRUE(camera.exposure);
      EXPECT_GT(*camera.exposure, 0);

      const auto balls = nlohmann::json::parse(read_file(view_file(room, id, "balls", "json")));
      if (balls.empty()) continue;
      ++with_balls;
      ASSERT_EQ(balls.size(), 3u);
      for (const auto& ball : balls) {
        EXPECT_LT(ball["center"][2].get<double>(), 0);
        EXPECT_GT(ball["radius"].get<double>(), 0);
        const Image picture = read_image(view_file(room, id, "ball_" + ball["name"].get<std::string>()));
        EXPECT_EQ(picture.width, 32);
      }
      EXPECT_EQ(balls[0]["name"], "mirror");
      EXPECT_FLOAT_EQ(balls[0]["roughness"].get<float>(), 0.02f);
      EXPECT_FLOAT_EQ(balls[2]["albedo"][0].get<float>(), 0.8f);
    }
  }
  EXPECT_GT(with_balls, 0);
}

// With next to no indirect light, and the same random numbers, a ball changes what shows it and what it shades alone.
TEST_F(Generate, PicturesWithBallsBoundIndirectLightAsTheViewDoes) {
  GenerateOptions o = small("bounded");
  o.balls = true, o.views.clamp = 1e-6;
  generate(test_device(), o);
  int compared = 0;
  for (const std::string& name : list_rooms(o.out, "train"))
    for (const std::string id : {"000", "001"}) {
      const fs::path with = view_file(o.out / name, id, "ball_mirror");
      if (!fs::exists(with)) continue;
      const Image plain = read_image(view_file(o.out / name, id, "im")), ball = read_image(with);
      int same = 0;
      for (std::size_t i = 0; i < plain.data.size(); ++i)
        same += std::abs(plain.data[i] - ball.data[i]) <= 1e-3f * plain.data[i] + 1e-4f;
      EXPECT_GT(same, 0.5 * static_cast<double>(plain.data.size())) << name << "/" << id;
      ++compared;
    }
  EXPECT_GT(compared, 0);
}

TEST_F(Generate, LightIsScaledLikeThePicture) {
  GenerateOptions o = small("a");
  o.rooms.count = 1, o.light.wanted = o.rooms.boxes = true, o.light.spp = 2;
  const GenerateSummary summary = generate(test_device(), o);
  EXPECT_EQ(summary.dropped, 0) << summary.first_dropped;
  EXPECT_GT(summary.light_seconds, 0);
  EXPECT_LT(summary.light_seconds, summary.seconds);
  const auto recipe = nlohmann::json::parse(read_file(o.out / "generate.json"));
  EXPECT_EQ(recipe["light_spp"], 2);
  EXPECT_EQ(recipe["probes"], 2);
  // The same room and camera traced again, with other random numbers.
  const Room same = make_box_room(room_seed(o, 0));
  TraceScene scene(test_device(), same.scene);
  std::size_t probes = 0;
  for (const std::string id : {"000", "001"}) {
    const fs::path room = o.out / room_name(o, 0);
    const CameraFile camera = read_camera(view_file(room, id, "camera", "json"));
    const float exposure = static_cast<float>(*camera.exposure);
    const TraceMaps maps = scene.maps(camera.camera);
    RadianceQuery query;
    query.spp = 2, query.seed = 99;
    query.max_depth = 0;
    const Envmaps files = read_envmaps(room, id, 32, 24),
                  emitted = trace_envmaps(scene, same.scene, camera.camera, maps, query);
    int lamps = 0;
    for (std::size_t i = 0; i < emitted.radiance.data.size(); ++i) {
      lamps += emitted.radiance.data[i] > 0;
      // Lamps are in the files; half precision rounds by 2^-11.
      ASSERT_GE(files.radiance.data[i], exposure * emitted.radiance.data[i] * (1 - 0x1p-10f));
    }
    EXPECT_GT(lamps, 100);
    query.max_depth = kMaxDepth;
    const Envmaps again = trace_envmaps(scene, same.scene, camera.camera, maps, query);
    double sum = 0, squares = 0, light = 0;
    for (std::size_t i = 0; i < again.radiance.pixels(); ++i) {  // channels vary as one: the first of them
      const double difference = static_cast<double>(files.radiance.data[i]) -
                                static_cast<double>(exposure) * static_cast<double>(again.radiance.data[i]);
      sum += difference, squares += difference * difference, light += static_cast<double>(files.radiance.data[i]);
    }
    EXPECT_LT(std::abs(sum), 4.5 * std::sqrt(squares)) << "seven in a million by chance";
    EXPECT_LT(std::sqrt(squares), 0.05 * light) << "the test could not see a twentieth";
    const std::vector<Probe> found = read_probes(room, id);
    probes += found.size();
    for (const Probe& probe : found) {
      EXPECT_GE(probe.distance, kProbeClearance);
      Probe lit = probe;
      query.max_depth = 0;
      trace_probe(scene, camera.camera, lit, query);
      for (std::size_t i = 0; i < lit.radiance.data.size(); ++i)
        ASSERT_GE(probe.radiance.data[i], exposure * lit.radiance.data[i] * (1 - 0x1p-10f));
      EXPECT_GT(*std::max_element(lit.radiance.data.begin(), lit.radiance.data.end()), 0) << "no lamp anywhere";
    }
  }
  EXPECT_GT(probes, 2u);
}

TEST_F(Generate, EmissionAndVarianceAreInThePicturesUnit) {
  GenerateOptions o = small("a");
  o.rooms.count = 1, o.rooms.boxes = true, o.views.spp = 64;
  generate(test_device(), o);
  const Room same = make_box_room(room_seed(o, 0));
  TraceScene scene(test_device(), same.scene);
  const auto total = [](const Image& image) { return std::accumulate(image.data.begin(), image.data.end(), 0.0); };
  for (const std::string id : {"000", "001"}) {
    const fs::path room = o.out / room_name(o, 0);
    const CameraFile camera = read_camera(view_file(room, id, "camera", "json"));
    const double exposure = *camera.exposure;
    const Image emission = read_image(view_file(room, id, "emission")), emitted = scene.maps(camera.camera).emission;
    for (std::size_t i = 0; i < emission.data.size(); ++i)
      ASSERT_NEAR(emission.data[i], exposure * emitted.data[i], 0x1p-11 * exposure * emitted.data[i]) << i;
    // Of other random numbers: as large, but for what noise does to it.
    const double stated = total(read_image(view_file(room, id, "variance"))),
                 again = total(scene.picture(camera.camera, o.views.spp, 99).variance);
    const double off = std::abs(std::log(stated / (exposure * exposure * again))), unit = std::abs(std::log(exposure));
    EXPECT_LT(off, unit / 2) << "an exposure of " << exposure << " too much or too little";
  }
}

TEST_F(Generate, WithoutLightThereIsNone) {
  GenerateOptions o = small("a");
  o.rooms.count = o.views.count = 1, o.rooms.boxes = true;
  EXPECT_EQ(generate(test_device(), o).light_seconds, 0);
  EXPECT_FALSE(fs::exists(view_file(o.out / room_name(o, 0), "000", "envmap")));
  for (const auto& [name, bytes] : contents(o.out)) EXPECT_EQ(name.find("probe"), std::string::npos) << name;
  // Folders made before there was light go on without it.
  EXPECT_FALSE(nlohmann::json::parse(read_file(o.out / "generate.json")).contains("probes"));
  o.light.wanted = true;
  EXPECT_THROW(generate(test_device(), o), Error);
}

TEST_F(Generate, LightChangesNothingElse) {
  GenerateOptions o = small("with");
  o.rooms.count = o.views.count = 1, o.rooms.boxes = o.light.wanted = true, o.light.probes = 1, o.views.clamp = 1;
  generate(test_device(), o);
  o.out = root_ / "without", o.light.wanted = false;
  generate(test_device(), o);
  const auto with = contents(root_ / "with"), without = contents(root_ / "without");
  for (const auto& [name, bytes] : without) {
    EXPECT_TRUE(name == "generate.json" || with.at(name) == bytes) << name;
  }
  EXPECT_GT(with.size(), without.size());
}

TEST_F(Generate, KilledRunEndsInTheSameBits) {
  GenerateOptions whole = small("whole");
  whole.light.wanted = true;
  generate(test_device(), whole);
  GenerateOptions o = small("killed");
  o.light.wanted = true;
  int asked = 0;
  o.interrupted = [&] { return ++asked > 2; };
  try {
    generate(test_device(), o);
    FAIL() << "was not interrupted";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Interrupted);
  }
  // A kill between two files of a view: all but its picture, which is written last, may be there.
  const fs::path room = o.out / room_name(o, 1);
  fs::create_directories(room);
  fs::copy_file(whole.out / room_name(o, 1) / "000_albedo.exr", room / "000_albedo.exr");
  std::ofstream(room / "000_depth.exr") << "half a file";
  std::ofstream(room / "000_envmap.exr") << "half a file";
  o.interrupted = {};
  const GenerateSummary summary = generate(test_device(), o);
  EXPECT_EQ(summary.skipped, 2);
  EXPECT_EQ(summary.made, 2);
  EXPECT_EQ(contents(o.out), contents(whole.out));
  EXPECT_EQ(generate(test_device(), o).made, 0);
}

TEST_F(Generate, ShardsTogetherAreTheWhole) {
  GenerateOptions whole = small("whole");
  whole.light.wanted = true;
  generate(test_device(), whole);
  for (int i = 0; i < 2; ++i) {
    GenerateOptions part = small("parts");
    part.rooms.shard = i, part.rooms.shards = 2, part.light.wanted = true;
    int last_total = 0;
    part.progress = [&](int, int total, bool) { last_total = total; };
    EXPECT_EQ(generate(test_device(), part).made, 2);
    EXPECT_EQ(last_total, 2);
  }
  EXPECT_EQ(contents(root_ / "parts"), contents(whole.out));
}

// What a point of the left view is in the right one: moved by focal length times baseline over depth, and as bright.
TEST_F(Generate, StereoPairsAreRectified) {
  GenerateOptions o = small("a");
  o.rooms.boxes = true, o.baseline = 0.5, o.views.spp = 64;
  generate(test_device(), o);
  for (const std::string id : {"000", "001"}) {
    const fs::path room = o.out / room_name(o, 0);
    const CameraFile left = read_camera(view_file(room, id, "camera", "json")),
                     right = read_camera(view_file(room, id, "right_camera", "json"));
    const auto pair = nlohmann::json::parse(read_file(view_file(room, id, "stereo", "json")));
    EXPECT_NEAR(pair["baseline_m"].get<double>(), 0.5, 1e-12);
    const auto pose = pair["right_to_left"].get<std::array<double, 16>>();
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(pose[i], i == 3 ? 0.5 : i % 5 == 0 ? 1 : 0, 1e-12) << i;
    EXPECT_EQ(right.exposure, left.exposure);
    const Vec3 apart = left.camera.to_camera(right.camera.position());
    EXPECT_NEAR(apart.x, 0.5, 1e-9);
    EXPECT_NEAR(glm::length(apart), 0.5, 1e-9);

    const RoomView view = read_view(room, id);
    const Image picture = read_image(view_file(room, id, "right"));
    ASSERT_EQ(picture.width, 32);
    // How much of the picture is another brightness where its points should be, for a baseline of so many times that.
    const auto elsewhere = [&](double times) {
      int moved = 0, other = 0;
      for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 32; ++x) {
          const double at = x + 0.5 - times * left.camera.fx * 0.5 / view.depth.at(0, y, x);
          if (at < 0 || at >= 32) continue;
          const float seen = picture.at(1, y, static_cast<int>(at)), was = view.image.at(1, y, x);
          ++moved, other += std::abs(seen - was) < 0.25f * (seen + was) ? 0 : 1;
        }
      return static_cast<double>(other) / moved;
    };
    for (const double wrong : {0.0, 2.0, -1.0}) EXPECT_LT(1.5 * elsewhere(1), elsewhere(wrong)) << id << " " << wrong;
  }
}

TEST_F(Generate, NoSecondCameraBehindAWall) {
  TraceScene scene(test_device(), plain_room());  // its walls are 2 m from the middle
  Camera left = Camera::from_fov(32, 24);
  left.set_pose(Mat3(1), {1.75, 1, 0});
  EXPECT_TRUE(right_camera(scene, left, 0.125));
  EXPECT_FALSE(right_camera(scene, left, 0.25)) << "in the wall";
  EXPECT_FALSE(right_camera(scene, left, 0.375)) << "behind it";
}

TEST_F(Generate, SeedsDiffer) {
  GenerateOptions a = small("a", 1), b = small("b", 2);
  a.rooms.count = b.rooms.count = 1, a.views.count = b.views.count = 1;
  generate(test_device(), a);
  generate(test_device(), b);
  const RoomView first = read_view(a.out / room_name(a, 0), "000"), second = read_view(b.out / room_name(b, 0), "000");
  EXPECT_NE(first.depth.data, second.depth.data);
  EXPECT_NE(room_name(a, 0), room_name(b, 0));
}

TEST_F(Generate, SplitsAreOfRooms) {
  GenerateOptions o = small("a");
  std::map<std::string, int> count;
  for (int i = 0; i < 100; ++i) ++count[split_of(o, i)];
  EXPECT_EQ(count["train"], 80);
  EXPECT_EQ(count["val"], 10);
  EXPECT_EQ(count["test"], 10);
  o.rooms.split = "test";
  EXPECT_EQ(split_of(o, 0), "test");
}

// An empty one would be a mistake to whoever reads it.
TEST_F(Generate, ASplitWithoutRoomsHasNoList) {
  GenerateOptions o = small("a");
  o.rooms.count = 9, o.views.count = 1, o.rooms.boxes = true;
  generate(test_device(), o);
  EXPECT_EQ(list_rooms(o.out, "val").size(), 1u);
  EXPECT_FALSE(fs::exists(o.out / "test.txt"));
  o.rooms.count = 8;
  generate(test_device(), o);
  EXPECT_EQ(list_rooms(o.out, "train").size(), 8u);
  EXPECT_FALSE(fs::exists(o.out / "val.txt")) << "a list of rooms that are none of the set now";
}

TEST_F(Generate, OtherOptionsInTheSameFolderAreRefused) {
  GenerateOptions o = small("a");
  o.rooms.count = 1, o.views.count = 1, o.rooms.boxes = true;
  generate(test_device(), o);
  o.views.spp = 9;
  try {
    generate(test_device(), o);
    FAIL() << "mixed views of two kinds";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
  }
}

TEST_F(Generate, OtherAssetsInTheSameFolderAreRefused) {
  GenerateOptions o = small("a");
  o.rooms.count = 1, o.views.count = 1;
  const fs::path assets = root_ / "assets";
  fs::create_directories(assets);
  for (const char* below : {"hdri", "models"})
    fs::copy(o.rooms.assets / below, assets / below, fs::copy_options::recursive);
  o.rooms.assets = assets;
  generate(test_device(), o);
  EXPECT_EQ(generate(test_device(), o).skipped, 1);
  fs::copy_file(assets / "models/bunny.glb", assets / "models/another.glb");
  EXPECT_THAT(message_of<Error>([&] { generate(test_device(), o); }), testing::HasSubstr("other options"));
  const auto made = nlohmann::json::parse(read_file(o.out / "generate.json"));
  auto older = made;
  older.erase("assets");  // of before they were named
  write_file(o.out / "generate.json", older.dump());
  EXPECT_EQ(generate(test_device(), o).skipped, 1);
  for (const auto& entry : fs::directory_iterator(assets / "models")) fs::remove(entry.path());
  EXPECT_THAT(message_of<Error>([&] { load_assets(assets, Setting::Training); }), testing::HasSubstr("no model"));
}

TEST_F(Generate, AnotherDataSetIsNotWrittenOver) {
  GenerateOptions o = small("theirs");
  o.rooms.count = 1, o.views.count = 1, o.rooms.boxes = true;
  for (const std::string& name : {std::string("train.txt"), room_name(o, 0) + "/000_im.exr"}) {
    fs::remove_all(o.out);
    fs::create_directories((o.out / name).parent_path());
    std::ofstream(o.out / name) << "of somebody else";
    const auto before = contents(o.out);
    try {
      generate(test_device(), o);
      FAIL() << name << " was taken for ours";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
    }
    EXPECT_EQ(contents(o.out), before);
  }
}

TEST_F(Generate, OptionsOutOfRange) {
  const auto refused = [&](auto change) {
    GenerateOptions o = small("never");
    change(o);
    try {
      generate(test_device(), o);
    } catch (const Error& e) {
      return e.kind() == ErrorKind::Usage && !fs::exists(root_ / "never");
    }
    return false;
  };
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.rooms.count = 0; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.views.count = -1; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.views.width = 0; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.views.spp = 0; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.light.spp = 0; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.light.probes = -1; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.light.probes = 101; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.rooms.shard = 1; }));
  for (const double baseline : {0.0, -0.1, 1.1, std::nan("")})
    EXPECT_TRUE(refused([=](GenerateOptions& o) { o.baseline = baseline; })) << baseline;
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.rooms.split = "some"; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.rooms.assets = "/nonexistent"; }));
  EXPECT_TRUE(refused([](GenerateOptions& o) { o.out.clear(); }));
}

}  // namespace
}  // namespace clerestory
