// Rays with known light out of generated views, batches of them, and a leg of training through the trainer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/panorama.hpp"
#include "host/math/statistics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 40, kHeight = 30;

/// Two bare rooms with their light, as coarse as they come.
struct LightTask : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    folder_ = std::make_unique<ScratchFolder>("clerestory-light-task");
    for (const char* split : {"train", "val"}) {
      GenerateOptions o;
      o.out = *folder_ / split, o.rooms.count = 1, o.views.count = 2, o.views.width = kWidth, o.views.height = kHeight,
      o.views.spp = 2;
      o.light.spp = 1, o.light.probes = 1, o.rooms.seed = 5, o.rooms.split = split, o.rooms.boxes = true;
      generate(Device::open(), o);
    }
  }
  static void TearDownTestSuite() { folder_.reset(), set_quiet(false); }

  static std::shared_ptr<const LightView> view() {
    LightStore store(name_views({(*folder_ / "train").string()}, "train"), kWidth, kHeight, 1 << 30);
    return store.get(0);
  }
  static Config config(const std::string& root, const std::vector<std::string>& more) {
    std::vector<std::string> all{"model.kind=light",
                                 fmt::format("model.width={}", kWidth),
                                 fmt::format("model.height={}", kHeight),
                                 "data.train=[" + (*folder_ / "train").string() + "]",
                                 "data.validation=[" + (*folder_ / "val").string() + "]",
                                 "run.root=" + (*folder_ / root).string(),
                                 "train.batch=2",
                                 "train.steps=4",
                                 "log.every=1",
                                 "log.validate_every=2",
                                 "log.checkpoint_every=2",
                                 "light.rows=4",
                                 "light.samples=16",
                                 "light.segments=4",
                                 "light.width=16",
                                 "light.layers=2",
                                 "light.shade_width=8",
                                 "light.shade_height=6"};
    all.insert(all.end(), more.begin(), more.end());
    write_file(*folder_ / "light.toml", "");
    return load_config(*folder_ / "light.toml", training_schema(), all);
  }
  static inline std::unique_ptr<ScratchFolder> folder_;
};

TEST_F(LightTask, RaysAreThoseOfTheFiles) {
  const auto v = view();
  const LightRays rays = draw_rays(*v, 6, 32, 0.34, 9);  // two points of six are probes
  ASSERT_EQ(rays.skip.size(), 6u * 32);
  int from_probes = 0;
  for (std::size_t row = 0; row < 6; ++row) {
    std::set<std::array<float, 3>> directions;
    for (std::size_t i = 32 * row; i < 32 * (row + 1); ++i) {
      const Vec3 &p = rays.points[i], &d = rays.directions[i];
      EXPECT_NEAR(glm::length(d), 1, 0x1p-22);  // as exact as the normals of the file
      directions.insert({static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)});
      if (rays.skip[i] < 0) {
        ++from_probes;
        EXPECT_EQ(p, v->probes[0].center);
        const Vec2 uv = panorama_position(d);
        const int x = static_cast<int>(uv.x * probe_width), y = static_cast<int>(uv.y * probe_height);
        for (int c = 0; c < 3; ++c)
          EXPECT_EQ(rays.light[i][static_cast<std::size_t>(c)], v->probes[0].radiance.at(c, y, x));
        continue;
      }
      const int x = rays.skip[i] % kWidth, y = rays.skip[i] / kWidth;
      EXPECT_EQ(-p.z, v->depth.at(0, y, x));
      const Vec2 seen = *v->camera.project(p);
      EXPECT_NEAR(seen.x, x + 0.5, 16 * kWidth * kDoubleRounding);
      EXPECT_NEAR(seen.y, y + 0.5, 16 * kWidth * kDoubleRounding);
      const Vec3 normal{v->normal.at(0, y, x), v->normal.at(1, y, x), v->normal.at(2, y, x)};
      EXPECT_GT(glm::dot(d, normal), 0);
    }
    if (rays.skip[32 * row] >= 0) {
      EXPECT_EQ(directions.size(), 32u) << "a direction twice";
    }
  }
  EXPECT_EQ(from_probes, 2 * 32);
  EXPECT_EQ(draw_rays(*v, 6, 32, 0.34, 9).light, rays.light);
  EXPECT_NE(draw_rays(*v, 6, 32, 0.34, 10).light, rays.light);
  EXPECT_THROW(draw_rays(*v, 1, 144, 0, 1), Error);
}

TEST_F(LightTask, PredictedMapsMovePointsButNotTheTruth) {
  LightStore store(name_views({(*folder_ / "train").string()}, "train"), kWidth, kHeight, 1 << 30);
  const auto truth = store.get(0);
  LightStore judged(store.names(), kWidth, kHeight, 0);
  const auto predict = [](const Image& picture) {
    MapSet maps{Image(kWidth, kHeight, 3, 0.25f), Image(kWidth, kHeight, 3), Image(kWidth, kHeight, 1),
                Image(kWidth, kHeight, 2, 0.75f)};
    for (std::size_t i = 0; i < picture.pixels(); ++i) {
      maps.normal.plane(2)[i] = 1;  // every surface faces the viewer
      maps.depth.data[i] = 0.5f + static_cast<float>(i) / static_cast<float>(picture.pixels());
    }
    return maps;
  };
  store.predict(predict, DepthUnit::True), judged.predict(predict, DepthUnit::Predicted);
  const auto seen = store.get(0);
  EXPECT_EQ(judged.get(0)->depth.data, predict(truth->image).depth.data) << "who judges does not know the truth";
  EXPECT_EQ(seen->albedo.data[7], 0.25f);
  EXPECT_EQ(seen->material.at(1, 3, 4), 0.75f);
  EXPECT_EQ(seen->material.at(2, 3, 4), 0);
  EXPECT_EQ(seen->normal.at(2, 5, 6), 1);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < seen->depth.pixels(); ++i) {
    ASSERT_GT(truth->depth.data[i], 0);
    ratios.push_back(static_cast<double>(truth->depth.data[i]) / static_cast<double>(seen->depth.data[i]));
  }
  EXPECT_NEAR(median(ratios), 1, 4 * kFloatRounding);
  // The light that was recorded belongs to the true surface: the same directions and radiance, from the point that is
  // seen at the same pixel.
  const LightRays before = draw_rays(*truth, 6, 32, 0.34, 9), after = draw_rays(*seen, 6, 32, 0.34, 9);
  EXPECT_EQ(after.light, before.light);
  EXPECT_EQ(after.directions, before.directions);
  EXPECT_EQ(after.skip, before.skip);
  for (std::size_t i = 0; i < after.skip.size(); ++i) {
    const int pixel = after.skip[i];
    const double depth = pixel < 0 ? -before.points[i].z : seen->depth.data[static_cast<std::size_t>(pixel)];
    EXPECT_DOUBLE_EQ(-after.points[i].z, depth);
  }
}

TEST_F(LightTask, MirroredBatchesAreTheSameRoom) {
  const auto v = view();
  LightTrainingOptions o{
      .batch = 2, .height = kHeight, .width = kWidth, .rows = 4, .samples = 16, .shade_height = 6, .shade_width = 8};
  // The same key with and without mirroring: one of a few keys is mirrored.
  bool seen = false;
  for (std::uint64_t key = 1; key < 8; ++key) {
    const LightBatch plain = light_batch({v, v}, o, {.clipped = 0, .flip = false}, {key, key});
    const LightBatch maybe = light_batch({v, v}, o, {.clipped = 0, .flip = true}, {key, key});
    const Tensor &p = plain.feeds.at("points1"), &q = maybe.feeds.at("points1");
    if (p.real == q.real) continue;
    seen = true;
    const std::size_t rays = 64;
    for (std::size_t i = 0; i < rays; ++i) {
      EXPECT_EQ(q.real[i], -p.real[i]);
      EXPECT_EQ(q.real[rays + i], p.real[rays + i]);
      const int a = plain.feeds.at("skip1").integer[i], b = maybe.feeds.at("skip1").integer[i];
      EXPECT_EQ(a < 0, b < 0);
      if (a >= 0) {
        EXPECT_EQ(a / kWidth * kWidth + kWidth - 1 - a % kWidth, b);
      }
    }
    EXPECT_EQ(maybe.feeds.at("light1").real, plain.feeds.at("light1").real);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        EXPECT_EQ(maybe.feeds.at("depth").at(1, 0, y, x), plain.feeds.at("depth").at(1, 0, y, kWidth - 1 - x));
        EXPECT_EQ(maybe.feeds.at("normal").at(1, 0, y, x), -plain.feeds.at("normal").at(1, 0, y, kWidth - 1 - x));
      }
    EXPECT_EQ(maybe.feeds.at("camera").at(0, 2, 0, 0), kWidth - plain.feeds.at("camera").at(0, 2, 0, 0));
  }
  EXPECT_TRUE(seen);
  o.shade_width = 7;
  EXPECT_THROW(light_batch({v}, o, {}, {1}), Error);
  EXPECT_THAT(message_of<Error>([&] { training_options(config("never", {"light.shade_width=7"})); }),
              testing::AllOf(testing::HasSubstr("light.shade_width"), testing::HasSubstr("one step along both sides")))
      << "before rooms are made";
}

TEST_F(LightTask, MapsOfBothKindsGiveOtherWeightsThanEither) {
  std::vector<std::vector<float>> weights;
  for (const char* maps : {"true", "predicted", "both"}) {
    const TrainingOutcome leg =
        train(config(maps, {std::string("light.maps=") + maps, "loss.radiance=relative"}), {"clerestory", "train"});
    const TensorFile file = read_safetensors(leg.weights);
    weights.push_back(file.get("local.mlp.out.weight", "leg").floats("local.mlp.out.weight"));
  }
  EXPECT_NE(weights[0], weights[1]);
  EXPECT_NE(weights[0], weights[2]);
  EXPECT_NE(weights[1], weights[2]);
}

TEST_F(LightTask, GoesOnUnderTheMapsThatItBeganWith) {
  const fs::path maps = *folder_ / "maps.safetensors";
  fs::copy_file(fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors", maps);
  const Config both =
      config("resumed", {"light.maps=both", "light.maps_weights=" + maps.string(), "loss.radiance=relative"});
  const fs::path run = train(both, {"clerestory", "train"}).folder;
  EXPECT_EQ(read_provenance(run / "provenance.json").inputs.at(0).path, maps.string());
  const auto as_if_killed = [&] {
    fs::remove(run / "DONE");
    for (const auto& entry : fs::directory_iterator(run / "checkpoints"))
      if (entry.path().string().find("0004") != std::string::npos) fs::remove(entry.path());
  };
  as_if_killed();
  EXPECT_NO_THROW(train(both, {"clerestory", "train"}));
  as_if_killed();
  TensorFile other = read_safetensors(maps);
  other.metadata["remark"] = "of another training";
  write_safetensors(maps, other, FloatStorage::F16);
  try {
    train(both, {"clerestory", "train"});
    FAIL() << "went on under other maps";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(e.what()).find("other maps"), std::string::npos) << e.what();
  }
}

TEST_F(LightTask, ALegEndsInTheSameBitsAndItsWeightsSayWhatTheyAre) {
  const TrainingOutcome first = train(config("a", {}), {"clerestory", "train"});
  const TrainingOutcome again = train(config("b", {}), {"clerestory", "train"});
  const TensorFile weights = read_safetensors(first.weights), other = read_safetensors(again.weights);
  const LightSizes compact = light_sizes("compact");
  EXPECT_EQ(weights.metadata.at("kind"), "weights");
  EXPECT_TRUE(weights.metadata.contains("error.all_relmse"));
  EXPECT_GT(weights.tensors.size(), light_states(compact).size() / 2);
  int compared = 0;
  for (const auto& [name, tensor] : weights.tensors) {
    const bool moments = name.starts_with("moments.");
    ASSERT_TRUE(moments || name.starts_with("local.") || name.starts_with("global.")) << name;
    EXPECT_EQ(tensor.floats(name), other.get(name, "b").floats(name)) << name;
    ++compared;
  }
  EXPECT_GT(compared, 100);
  const std::string page = read_file(first.folder / "report.html");
  EXPECT_LT(page.find(">Probes<"), page.find("<table>"));
  EXPECT_EQ(page.find(first.folder.parent_path().string()), std::string::npos) << "no folder of this computer";
  const std::string card = read_file(first.folder / "artifacts" / "card.md", 1 << 20);
  EXPECT_NE(card.find("Weights of the light"), std::string::npos);
  EXPECT_NE(card.find("rays that miss"), std::string::npos);
}

TEST_F(LightTask, OfStreamedRoomsItEndsInTheSameBitsAndIsJudgedByLists) {
  const std::vector<std::string> streamed{"stream.setting=training",
                                          "stream.views=1",
                                          "stream.spp=1",
                                          "stream.light_spp=1",
                                          "stream.probes=1",
                                          "stream.times=2",
                                          "stream.window=2",
                                          "stream.fixed=0.25",
                                          "light.maps=both",
                                          "data.lists=[\"bare=" + (*folder_ / "val").string() + "\"]"};
  const TrainingOutcome first = train(config("e", streamed), {"clerestory", "train"});
  const TrainingOutcome again = train(config("f", streamed), {"clerestory", "train"});
  const TensorFile weights = read_safetensors(first.weights), other = read_safetensors(again.weights);
  ASSERT_FALSE(weights.tensors.empty());
  for (const auto& [name, tensor] : weights.tensors)
    EXPECT_EQ(tensor.floats(name), other.get(name, "f").floats(name)) << name;
  const Leg leg = read_history(first.weights).legs.at(0);
  EXPECT_EQ(leg.rooms, 1 + 2 + leg.steps * 2 / 2);  // a fixed one, a window, and those that came until the best step
  ASSERT_EQ(leg.curve.back().lists.size(), 1u);
  EXPECT_EQ(leg.curve.back().lists[0].views, 2);
  EXPECT_EQ(leg.curve.back().lists[0].errors, leg.curve.back().errors) << "the same views";
}

/// Losses of the first `steps` of a leg behind legs that saw `before` views; nothing is learned.
std::vector<double> losses_of_leg(const TrainingOptions& options, std::int64_t before, int steps) {
  const Device device = Device::open();
  const auto states = std::make_shared<States>(device);
  const auto task = light_task(device, options, {states, states});
  TrainingProgress progress;
  progress.history.legs.resize(2);
  progress.history.legs[0].views_seen = before;
  task->begin(progress);
  std::vector<double> losses;
  for (int i = 0; i < steps; ++i) losses.push_back(task->step(0).losses.at(0).second);
  return losses;
}

TEST_F(LightTask, ASecondLegOfOneSeedGoesOnWithTheBatchesOfTheFirst) {
  const TrainingOptions options = training_options(config("legs", {}));
  const std::vector<double> first = losses_of_leg(options, 0, 4), second = losses_of_leg(options, 4, 2);
  EXPECT_EQ(second[0], first[2]) << "batches of two: four views are behind it";
  EXPECT_EQ(second[1], first[3]);
  EXPECT_NE(second[0], first[0]);
  EXPECT_NE(first[0], first[1]);
  // What the graph draws follows the seed, too.
  EXPECT_NE(losses_of_leg(training_options(config("legs", {"run.seed=2"})), 0, 1)[0], first[0]);
}

TEST_F(LightTask, ViewsWithoutLightAreRefused) {
  GenerateOptions o;
  o.out = *folder_ / "dark", o.rooms.count = 1, o.views.count = 1, o.views.width = kWidth, o.views.height = kHeight,
  o.views.spp = 2;
  o.light.wanted = false, o.rooms.split = "train", o.rooms.boxes = true;
  generate(Device::open(), o);
  try {
    train(config("c", {"data.train=[" + (*folder_ / "dark").string() + "]"}), {"clerestory", "train"});
    FAIL() << "trained in the dark";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("envmap.exr"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace clerestory
