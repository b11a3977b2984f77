// The oracle ladder: its measures on cases made by hand, its top rung against the truth, and both studies that ask
// learned light of rooms, end to end and resumed. The nets are untrained.
#include "experiments/studies/ladder_study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "experiments/applications/light_choice.hpp"
#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/agreement.hpp"
#include "experiments/studies/findings.hpp"
#include "experiments/studies/ladder_room.hpp"
#include "experiments/studies/study.hpp"
#include "experiments/studies/truth_study.hpp"
#include "experiments/truth/traced_room.hpp"
#include "experiments/truth/true_hits.hpp"
#include "experiments/truth/truth_light.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;

/// Two rays of one colour: the first is said to hit by three quarters and does, the second to hit surely and does not.
LinkAnswers two_rays() {
  LinkAnswers a;
  const auto grey = [](float first, float second) {
    return std::vector<float>{first, second, first, second, first, second};
  };
  a.truth = grey(10, 20), a.far = grey(4, 0), a.mixed = grey(0.75f * 2 + 0.25f * 4, 6), a.u = {0.25f, 0};
  a.at_true_hits = grey(3, 5), a.true_pixel = {7, -1};
  return a;
}
std::vector<float> red(const Links& links) {
  const std::vector<float> all = linked_radiance(two_rays(), links);
  EXPECT_EQ(std::vector<float>(all.begin() + 2, all.begin() + 4), std::vector<float>(all.begin(), all.begin() + 2));
  return {all[0], all[1]};
}

TEST(LinkedRadiance, EachLinkIsReplacedAlone) {  // all values are exact in binary
  EXPECT_THAT(red({}), ElementsAre(2.5f, 6));
  EXPECT_THAT(red({.in_view = true}), ElementsAre(0.75f * 10 + 1, 20));
  EXPECT_THAT(red({.out_of_view = true}), ElementsAre(1.5f + 0.25f * 10, 6));
  EXPECT_THAT(red({.hits = true}), ElementsAre(3, 5));
  EXPECT_THAT(red({.hits = true, .in_view = true}), ElementsAre(10, 5));
  EXPECT_THAT(red({.hits = true, .out_of_view = true}), ElementsAre(3, 20));
  EXPECT_THAT(red({false, true, true}), ElementsAre(10, 20));
  EXPECT_THAT(red({true, true, true}), ElementsAre(10, 20));
}

TEST(LinkedRadiance, TimeIsThatOfWhatIsAsked) {
  const LinkSeconds seconds{1, 10, 100, 1000};
  EXPECT_EQ(seconds.of({}), 11);
  EXPECT_EQ(seconds.of({.hits = true}), 111);
  EXPECT_EQ(seconds.of({.in_view = true}), 1011);
  EXPECT_EQ(seconds.of({true, true, true}), 1001);
}

TEST(Ladder, ErrorOfAPairHoldsNoVariance) {
  const std::vector<bool> used{true, true, false};
  const auto image = [](float first, float second) {
    Image i(3, 1, 3, 99);
    for (int c = 0; c < 3; ++c) i.plane(c)[0] = first, i.plane(c)[1] = second;
    return i;
  };
  // Bias of 0.2 in the first pixel, whose noise is opposite in both; the truth is 1 in both halves.
  const Image truth = image(1, 1);
  EXPECT_NEAR(relmse_of_pair(image(1.2f, 1), image(1.2f, 1), truth, truth, used), 0.5 * 0.04 / 1.01,
              1.2 * kFloatRounding * 0.2);
  EXPECT_DOUBLE_EQ(relmse_of_pair(image(1, 1.5f), image(1, 0.5f), truth, truth, used), -0.5 * 0.25 / 1.01);
  // Noise of the truth's halves drops out of a right picture too: (1 - 1.5) (1 - 0.5), either way round.
  EXPECT_DOUBLE_EQ(relmse_of_pair(truth, truth, image(1.5f, 1), image(0.5f, 1), used), -0.5 * 0.25 / 1.01);
  EXPECT_THROW(relmse_of_pair(truth, truth, truth, truth, {false, false, false}), Error);
}

TEST(Ladder, AChangeThatRoomsDoNotShareIsNone) {
  EXPECT_NEAR(clear_change({2, 2.2, 2.4, NAN, 9}, {1.8, 1.98, 2.16, 7, NAN}).value(), -0.1, 1e-12);
  EXPECT_GT(clear_change({1.8, 1.98, 2.16}, {2, 2.2, 2.4}).value(), 0);
  EXPECT_FALSE(clear_change({2, 2.2, 2.4}, {1, 2.5, 1.2})) << "one of three rooms got worse";
  EXPECT_FALSE(clear_change({1, NAN}, {0.5, 2}));
  EXPECT_TRUE(rungs().front().links == Links{} && !rungs().front().true_maps);
  EXPECT_TRUE(rungs().back().links.all_light() && rungs().back().true_maps);
}

/// A bare room seen in 16 x 12 pixels, and weights.
struct LadderRoomTest : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    folder_ = std::make_unique<ScratchFolder>("clerestory-ladder");
    write_untrained_light(weights());
    device_.emplace(Device::open());
    const Room room = make_box_room(10);
    traced_.emplace(*device_, room.scene);
    camera_ = choose_views(*traced_, room, 1, 16, 12, Random(5)).at(0);
    scene_ = scene_of(traced_->maps(camera_), camera_);
    scene_.photo = traced_->picture(camera_, 16, 1).mean;
  }
  static void TearDownTestSuite() { traced_.reset(), device_.reset(), folder_.reset(), set_quiet(false); }
  static fs::path weights() { return *folder_ / "weights"; }
  static ShadedSurface surface() { return {scene_, scene_.depth, scene_.normal, true}; }

  static inline std::unique_ptr<ScratchFolder> folder_;
  static inline std::optional<Device> device_;
  static inline std::optional<TraceScene> traced_;
  static inline Camera camera_;
  static inline Scene scene_;
};

TEST_F(LadderRoomTest, TrueHitsAreThePixelsThatShowTheSurface) {
  const int pixels = camera_.width * camera_.height;
  const auto n = static_cast<std::size_t>(pixels);
  std::vector<float> eye(3 * n, 0), ahead(3 * n), back(3 * n);
  for (int i = 0; i < pixels; ++i) {
    const Vec3 d = camera_.direction(i % camera_.width + 0.5, i / camera_.width + 0.5);
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = static_cast<std::size_t>(c * pixels + i);
      ahead[at] = static_cast<float>(d[c]), back[at] = -ahead[at];
    }
  }
  const std::vector<int> seen = true_hits(*traced_, camera_, eye, ahead),
                         behind = true_hits(*traced_, camera_, eye, back);
  for (int i = 0; i < pixels; ++i) {
    EXPECT_EQ(seen[static_cast<std::size_t>(i)], scene_.depth.data[static_cast<std::size_t>(i)] > 0 ? i : -1);
    EXPECT_EQ(behind[static_cast<std::size_t>(i)], -1);
  }
  // Above the picture, below it and beside it a camera shows nothing, whatever it would hit.
  for (const auto& [x, y] :
       {std::pair{0.5, -0.5}, {0.5, 0.5 + camera_.height}, {-0.5, 0.5}, {0.5 + camera_.width, 0.5}}) {
    const Vec3 d = camera_.direction(x, y);
    const std::vector<float> out{static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)};
    EXPECT_EQ(true_hits(*traced_, camera_, {0, 0, 0}, out), std::vector{-1}) << x << " " << y;
  }
  // From behind what a pixel shows, going on: that ends on something the camera does not see.
  std::vector<float> beyond(3 * n);
  for (int i = 0; i < pixels; ++i) {
    const Vec3 p = camera_.unproject(i % camera_.width + 0.5, i / camera_.width + 0.5,
                                     scene_.depth.data[static_cast<std::size_t>(i)] + 0.05);
    for (int c = 0; c < 3; ++c) beyond[static_cast<std::size_t>(c * pixels + i)] = static_cast<float>(p[c]);
  }
  for (const int pixel : true_hits(*traced_, camera_, beyond, ahead)) EXPECT_EQ(pixel, -1);
}

TEST_F(LadderRoomTest, TheTopRungIsThePictureUnderTrueLight) {
  constexpr int kBatches = 8;
  RenderSettings settings;
  settings.light = "net", settings.spp = 64, settings.points = "independent";
  load_light_nets(settings, weights(), *device_);
  LinkedLight light(*device_, scene_, settings);
  Batches ours, theirs;
  std::vector<bool> used;
  for (std::uint32_t k = 0; k < kBatches; ++k) {
    settings.seed = 100 + k;
    const LinkedPictures p = light.render(*traced_, 1, surface(), settings, {{true, true, true}}, 256);
    ours.emplace_back(p.radiance[0].data.begin(), p.radiance[0].data.end());
    settings.seed = 200 + k, settings.spp = 256;
    theirs.push_back(render_truth(*device_, *traced_, scene_, settings).whole.radiance.real);
    settings.spp = 64, used = p.shaded;
    EXPECT_EQ(p.dropped, 0);
  }
  const Agreement a = agreement(ours, theirs, used, 0.9975);
  EXPECT_GT(a.pixels, 0.8 * 16 * 12);
  // One false alarm in ten thousand seeds, and the seeds are fixed.
  EXPECT_GT(student_two_sided_p(a.z(), kBatches - 1), 1e-4) << a.z();
  EXPECT_LT(a.error, 0.05) << "the test sees nothing";
}

TEST_F(LadderRoomTest, AllPredictedIsTheLayerUnderTheNet) {
  RenderSettings settings;
  settings.light = "net", settings.spp = 16, settings.seed = 3;
  load_light_nets(settings, weights(), *device_);
  LinkedLight light(*device_, scene_, settings);
  const LinkedPictures p = light.render(*traced_, 1, surface(), settings,
                                        {{}, {.in_view = true}, {.out_of_view = true}, {true, true, true}}, 16);
  const Rendering net = render_scene(*device_, scene_, settings);
  double most = 0;
  for (const float v : net.radiance.data) most = std::max(most, static_cast<double>(v));
  for (std::size_t i = 0; i < net.radiance.data.size(); ++i) {
    EXPECT_NEAR(p.radiance[0].data[i], net.radiance.data[i], 64 * 0x1p-23 * most) << i;
    // In view and out of view share the truth: u + (1 - u) = 1, and so with what the net says, of which either leaves
    // out shares below a thousandth.
    EXPECT_NEAR(p.radiance[1].data[i] + p.radiance[2].data[i], p.radiance[0].data[i] + p.radiance[3].data[i],
                2e-3 * (most + p.radiance[3].data[i]))
        << i;
  }
}

/// Tables of a study on tiny rooms.
struct LitStudies : LadderRoomTest {
  static Config config(const std::string& name, std::vector<std::string> words) {
    words.insert(words.end(), {"run.root=" + (*folder_ / "runs").string(), "light.weights=" + weights().string(),
                               "data.width=48", "data.height=36", "data.spp=4"});
    return study_config(fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs" / name, words);
  }
  static std::vector<MetricRecord> without_seconds(const fs::path& run) {
    std::vector<MetricRecord> records = read_metrics(run / "metrics.jsonl");
    for (MetricRecord& r : records) {
      r.seconds = 0;
      std::erase_if(r.values, [](const auto& v) { return v.first.starts_with("seconds|"); });
    }
    return records;
  }
  /// Names of the files that a run says it rests on.
  static std::vector<std::string> inputs_of(const fs::path& run) {
    std::vector<std::string> names;
    for (const FileRecord& input : read_provenance(run / "provenance.json").inputs) {
      EXPECT_EQ(input.hash, file_hash(input.path));
      names.push_back(fs::path(input.path).filename().string());
    }
    return names;
  }
  /// Goes on after the first room and ends as the whole run did.
  static void expect_resumed(const Config& c, const fs::path& run) {
    const std::vector<MetricRecord> whole = without_seconds(run);
    ASSERT_EQ(whole.size(), 2u);
    fs::remove(run / "DONE");
    cut_metrics(run / "metrics.jsonl", 1);
    EXPECT_EQ(run_study(c, {"clerestory"}), run.string());
    const std::vector<MetricRecord> again = without_seconds(run);
    ASSERT_EQ(again.size(), 2u);
    for (std::size_t r = 0; r < 2; ++r) EXPECT_EQ(again[r].values, whole[r].values);
  }
};

TEST_F(LitStudies, LadderEndToEndAndResumed) {
  const Config c = config("oracle_ladder.toml", {"data.rooms=2", "ladder.spp=4", "ladder.emission_spp=16"});
  const fs::path run = run_study(c, {"clerestory"});
  const RunTables tables = study_tables(run);
  EXPECT_EQ(tables.at("ladder").rows.size(), 1 + 4 + 4 + 1 + 6 + 1u);
  EXPECT_EQ(tables.at("ladder_bar").rows.size(), 4u);
  for (const auto& row : tables.at("ladder").rows)
    EXPECT_TRUE(!std::holds_alternative<Measure>(row[1]) || std::isfinite(std::get<Measure>(row[1]).mean));
  EXPECT_TRUE(fs::exists(run / "report.html"));
  EXPECT_TRUE(fs::exists(run / "artifacts/room0_render_tracer_then_rungs.png"));
  expect_resumed(c, run);
  EXPECT_THAT(inputs_of(run), ElementsAre("judged.txt", "judged.rooms", "light_local.safetensors",
                                          "light_global.safetensors", "maps.safetensors"));
  const Provenance provenance = read_provenance(run / "provenance.json");
  EXPECT_EQ(provenance.rooms.seeds.size(), 2u);
  EXPECT_EQ(provenance.hashes.at("config"), config_hash(c));
  EXPECT_GT(provenance.figures.at("minutes"), 0);
  EXPECT_GT(read_metrics(run / "metrics.jsonl")[1].seconds, 0.1) << "records keep the time of the whole run";
}

TEST_F(LitStudies, WhatAUserGetsEndToEndAndResumed) {
  const Config c = config("user.toml", {"data.rooms=2", "user.spp=4", "user.truth_spp=4", "user.probe_spp=2",
                                        "user.lights=[net+lamps, constant, constant+fit]"});
  const fs::path run = run_study(c, {"clerestory"});
  const RunTables tables = study_tables(run);
  const Table& user = tables.at("1_user");
  ASSERT_EQ(user.rows.size(), 2 * 5u)
      << "three lights, the photograph unchanged and an oracle, by predicted and true maps";
  EXPECT_EQ(std::get<std::string>(user.rows[0][0]), "predicted") << "what a user gets comes first";
  for (const auto& row : user.rows)
    for (const Cell& cell : row)
      EXPECT_TRUE(!std::holds_alternative<Measure>(cell) || std::isfinite(std::get<Measure>(cell).mean));
  EXPECT_EQ(tables.at("2_maps").rows.size(), 6u);
  for (const char* file : {"report.html", "artifacts/room0_photo_tracers_ball_then_lights.png"})
    EXPECT_TRUE(fs::exists(run / file));

  // The oracle reads the truth: no constant is closer to it, of the picture and of the light in the air.
  // A ratio of the truth to a sum that is rounded to float in another order: 1e-6.
  Findings found;
  for (const MetricRecord& record : read_metrics(run / "metrics.jsonl")) found.add_room(record, run.string());
  ASSERT_EQ(found.rooms(), 2u);
  for (std::size_t r = 0; r < found.rooms(); ++r) {
    const auto value = [&](const Finding& finding) { return found.value(r, finding).value(); };
    for (const char* constant : {"constant", "constant+fit"})
      EXPECT_LE(value({"relmse", "air", "oracle", "true", "0"}),
                value({"relmse", "air", constant, "true", "0"}) * (1 + 1e-6));
    EXPECT_LE(value({"smape", "render", "oracle", "true", "0"}),
              value({"smape", "render", "constant", "true", "0"}) * (1 + 1e-6));
  }
  expect_resumed(c, run);
  EXPECT_THAT(inputs_of(run), ElementsAre("judged.txt", "judged.rooms", "light_local.safetensors",
                                          "light_global.safetensors", "maps.safetensors"));
}

TEST_F(LitStudies, OtherWeightsDoNotGoOnWithARun) {
  const Config c = config("edit.toml", {"data.rooms=2", "edit.spp=4", "edit.seeds=1", "edit.lights=[net]"});
  const fs::path run = run_study(c, {"clerestory"});
  EXPECT_THAT(inputs_of(run),
              ElementsAre("judged.txt", "judged.rooms", "light_local.safetensors", "light_global.safetensors"));
  fs::remove(run / "DONE");
  cut_metrics(run / "metrics.jsonl", 1);
  std::string text = read_file(run / "provenance.json");
  const std::string hash = read_provenance(run / "provenance.json").inputs[2].hash;
  text.replace(text.find(hash), hash.size(), "0123456789abcdef");
  write_file(run / "provenance.json", text);
  const auto refusal = [&] { return message_of([&] { run_study(c, {"clerestory"}); }, ErrorKind::Usage); };
  EXPECT_THAT(refusal(), testing::HasSubstr("light_local.safetensors")) << "rooms under two lights in one table";

  Provenance elsewhere = read_provenance(run / "provenance.json");
  elsewhere.device = "a GPU", elsewhere.inputs[2].hash = hash;
  write_provenance(run / "provenance.json", elsewhere);
  EXPECT_THAT(refusal(), testing::HasSubstr("another device")) << "seconds of two devices in one table";
}

TEST_F(LitStudies, WithoutWeightsTheySayWhichAreMissing) {
  ::setenv("CLERESTORY_LIGHT_WEIGHTS", (*folder_ / "nothing").c_str(), 1);
  for (const char* name : {"oracle_ladder.toml", "user.toml"}) {
    const Config c = study_config(fs::path(CLERESTORY_SOURCE_DIR) / "experiments/configs" / name,
                                  {"run.root=" + (*folder_ / "runs").string(), "data.rooms=1", "run.variant=none"});
    try {
      run_study(c, {"clerestory"});
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      EXPECT_THAT(std::string(e.what()), testing::HasSubstr("no weights of the light"));
    }
  }
  ::unsetenv("CLERESTORY_LIGHT_WEIGHTS");
}

}  // namespace
}  // namespace clerestory
