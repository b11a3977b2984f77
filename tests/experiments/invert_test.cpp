// The main job from end to end through the real program, on a small generated room with true maps: no weights needed.
#include "experiments/applications/invert.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "experiments/applications/insert.hpp"
#include "experiments/applications/render_record.hpp"
#include "experiments/applications/replay.hpp"
#include "experiments/applications/run_folder.hpp"
#include "host/error.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "host/report/provenance.hpp"
#include "tests/experiments/bare_room.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// One box room, made once, and a folder for results.
class InvertTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / fmt::format("clerestory-invert-{}", ::getpid());
    fs::create_directories(folder_);
    view_ = make_bare_room(Device::open(), folder_ / "rooms", 32, 1);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static InvertOptions options(const std::string& name) {
    InvertOptions o;
    o.photo = view_.string() + "_im.exr", o.gbuffer = view_, o.out = folder_ / name;
    o.command = {"clerestory", "invert"};
    return o;
  }

  static inline fs::path folder_, view_;
};

double mean_square(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(static_cast<double>(a.data[i]) - b.data[i], 2);
  return sum / static_cast<double>(a.data.size());
}

TEST_F(InvertTest, WritesAWholeRunAndTheSameOneTwice) {
  const fs::path a = invert(options("a")), b = invert(options("b"));
  for (const char* name :
       {"albedo.exr", "normal.exr", "depth.exr", "material.exr", "rerender.exr", "stderr.exr", "uncertainty.exr",
        "camera.json", "provenance.json", "report.html", "plan.txt", "albedo.png", "rerender.png"})
    EXPECT_TRUE(fs::exists(a / name)) << name;
  for (const char* name : {"rerender.exr", "stderr.exr", "uncertainty.exr"})
    EXPECT_EQ(read_file(a / name), read_file(b / name)) << name << ": equal seeds, equal bits";
  const Scene scene = read_run(a);
  const Rerender r = read_rerender(a);
  EXPECT_EQ(r.radiance.width, 64);
  for (const float v : r.radiance.data) ASSERT_TRUE(std::isfinite(v) && v >= 0);
  for (const float u : r.uncertainty.data) ASSERT_TRUE(u >= 0 && u <= 1);
  EXPECT_GT(scene.scale(), 0.5);
}

TEST_F(InvertTest, StandardErrorTellsHowFarSeedsDiffer) {
  InvertOptions first = options("seed1"), second = options("seed2");
  first.render.points = second.render.points = "independent";
  first.render.seed = 1, second.render.seed = 2;
  const Rerender a = read_rerender(invert(first)), b = read_rerender(invert(second));
  // The difference of two independent means has variance s1^2 + s2^2: chi-square over the pixels, whose heavy-tailed
  // radiance (a small lamp) widens it; a third either way is far outside of 9216 degrees of freedom only if one is
  // wrong.
  double observed = 0, expected = 0;
  for (std::size_t i = 0; i < a.radiance.data.size(); ++i) {
    observed += std::pow(static_cast<double>(a.radiance.data[i]) - b.radiance.data[i], 2);
    expected += std::pow(a.standard_error.data[i], 2) + std::pow(b.standard_error.data[i], 2);
  }
  EXPECT_NEAR(observed / expected, 1, 1.0 / 3);
}

TEST_F(InvertTest, MoreSamplesComeCloserToTheTruthOfTheLayer) {
  InvertOptions coarse = options("coarse"), fine = options("fine"), truth = options("truth");
  coarse.render.spp = 8, fine.render.spp = 128, truth.render.spp = 4096, truth.render.seed = 99;
  const Image t = read_rerender(invert(truth)).radiance;
  EXPECT_LT(mean_square(read_rerender(invert(fine)).radiance, t),
            0.5 * mean_square(read_rerender(invert(coarse)).radiance, t));
}

TEST_F(InvertTest, ACameraBesideGivenMapsIsReadOnlyWhenItIsNeeded) {
  const fs::path maps = invert(options("maps"));
  write_file(maps / "camera.json", "{\"width\": 64, \"height\": 48}\n");  // no fx
  InvertOptions o = options("with fov");
  o.gbuffer = maps;
  EXPECT_THROW(invert(o), Error);
  o.fov = 55;
  EXPECT_NO_THROW(invert(o));
  o.fov.reset(), o.camera = folder_ / "mine.json", o.out = folder_ / "with camera";
  write_camera(o.camera, Camera::from_fov(64, 48, 60));
  EXPECT_NO_THROW(invert(o));
}

TEST_F(InvertTest, ThicknessLetsRaysPassBehindSurfaces) {
  InvertOptions thick = options("thick"), thin = options("thin"), negative = options("negative");
  thin.render.thickness = 0.05, negative.render.thickness = -1;
  const fs::path a = invert(thick), b = invert(thin);
  const auto hits = [](const fs::path& run) {
    return read_provenance(run / "provenance.json").figures.at("rays that hit");
  };
  EXPECT_LT(hits(b), hits(a));
  EXPECT_GT(hits(b), 0);
  EXPECT_NE(read_file(a / "rerender.exr"), read_file(b / "rerender.exr"));
  EXPECT_THROW(invert(negative), Error);
}

TEST_F(InvertTest, OnlySomeMapsMeansNoRerender) {
  InvertOptions o = options("only");
  o.only = {"albedo", "depth"};
  const fs::path out = invert(o);
  EXPECT_TRUE(fs::exists(out / "albedo.exr") && fs::exists(out / "depth.exr") && fs::exists(out / "report.html"));
  EXPECT_FALSE(fs::exists(out / "normal.exr") || fs::exists(out / "rerender.exr"));
  EXPECT_THROW(read_run(out), Error);
  o.only = {"albdo"};
  EXPECT_THROW(invert(o), Error);
}

TEST_F(InvertTest, NoRoomIsMillimetresOrKilometresDeep) {
  const auto refusal = [](auto change) {
    InvertOptions o = options("deep");
    o.gbuffer.clear(), o.only = {"depth"};
    change(o);
    return message_of([&] { invert(o); }, ErrorKind::Usage);
  };
  EXPECT_THAT(refusal([](InvertOptions& o) {
                o.known = KnownDepth{5, 5, 2.5e6};
              }),
              testing::AllOf(testing::HasSubstr("--known"), testing::HasSubstr("99th percentile")));
  EXPECT_THAT(refusal([](InvertOptions& o) { o.depth_scale = 1e-60; }), testing::HasSubstr("--depth-scale"));
  EXPECT_FALSE(fs::exists(folder_ / "deep"));
}

TEST_F(InvertTest, AFailureLeavesTheOldRunAsItWas) {
  const fs::path out = invert(options("kept"));
  const std::string before = read_file(out / "provenance.json");
  InvertOptions bad = options("kept");
  bad.render.light = "sunshine";
  EXPECT_THROW(invert(bad), Error);
  EXPECT_EQ(read_file(out / "provenance.json"), before);
  for (const auto& entry : fs::directory_iterator(folder_))
    EXPECT_THAT(entry.path().filename().string(), ::testing::Not(::testing::HasSubstr("kept.")));
}

TEST_F(InvertTest, HowARunWasRenderedIsReadAsItWasWritten) {
  RenderRecord wrote;
  RenderSettings& s = wrote.settings;
  s.light = "constant", s.sampler = "guided", s.points = "independent", s.ssrt = "dda", s.delta = "window";
  s.thickness = 0.3, s.brdf = "li2020", s.leave_out = {Saving::Lobes, Saving::SmallShares};
  s.lamps = {{{1, 2, -3}, 0.25, {4, 5, 6}}, {{-1, 0, -2}, 0.5, {0.1, 0.2, 0.3}}};
  wrote.rounds = {{16, 3}, {32, 4}}, wrote.shared = true;
  write_render_record(folder_ / "render.json", wrote);
  const RenderRecord read = read_render_record(folder_ / "render.json", Device::open(""));
  const RenderSettings& r = read.settings;
  EXPECT_EQ(std::tie(r.light, r.sampler, r.points, r.ssrt, r.delta, r.thickness, r.brdf, r.leave_out),
            std::tie(s.light, s.sampler, s.points, s.ssrt, s.delta, s.thickness, s.brdf, s.leave_out));
  ASSERT_EQ(r.lamps.size(), 2);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(r.lamps[k].place, s.lamps[k].place);
    EXPECT_EQ(r.lamps[k].size, s.lamps[k].size);
    EXPECT_EQ(r.lamps[k].radiance, s.lamps[k].radiance);
  }
  ASSERT_EQ(read.rounds.size(), 2);
  EXPECT_EQ(read.rounds[1].spp, 32);
  EXPECT_EQ(read.rounds[1].seed, 4u);
  EXPECT_TRUE(read.shared);
  EXPECT_EQ(r.sharing, Sharing::Always);

  std::string text = read_file(folder_ / "render.json", 1 << 20);
  text.replace(text.find("small shares"), 12, "small change");
  write_file(folder_ / "render.json", text);
  EXPECT_THROW(read_render_record(folder_ / "render.json", Device::open("")), Error);
}

TEST_F(InvertTest, AnySampleOfARunCanBeTakenAgain) {
  InvertOptions o = options("replayed");
  o.render.light = "image", o.render.spp = 16, o.goal = RenderGoal{.error = 1e-3, .most = 48};  // in rounds
  const fs::path run = invert(o);
  const Image picture = read_rerender(run).radiance;
  double sum = 0;
  for (int s = 0; s < 48; ++s) {
    const Replayed sample = replay_of_run({run, 30, 20, s, ""});
    EXPECT_EQ(sample.seed, round_seed(0, s < 16 ? 0 : s < 32 ? 1 : 2));
    sum += sample.in_float.back().values[1];
  }
  EXPECT_NEAR(sum, picture.at(1, 20, 30), 0x1p-11 * sum) << "the picture is stored in half";
  EXPECT_THROW(replay_of_run({run, 30, 20, 48, ""}), Error);
  EXPECT_THROW(replay_of_run({run, 64, 20, 0, ""}), Error);
  fs::remove(run / "render.json");
  EXPECT_THROW(replay_of_run({run, 30, 20, 0, ""}), Error);
}

TEST_F(InvertTest, SaysWhatItLeftOutAndWhatThatSaved) {
  InvertOptions o = options("saved");
  o.render.light = "constant", o.measure = true;
  const Provenance less = read_provenance(invert(o) / "provenance.json");
  ASSERT_EQ(less.left_out.size(), 2u);
  EXPECT_THAT(less.left_out[1].what, ::testing::HasSubstr("screen-space rays"));
  EXPECT_THAT(less.left_out[1].saved, ::testing::HasSubstr("s measured"));
  EXPECT_GT(less.figures.at("seconds saved, predicted: tracing"), 0);
  EXPECT_GT(less.figures.at("seconds saved, measured: tracing"), 0);
  InvertOptions all = options("everything");
  all.render.light = "constant", all.render.leave_out.clear();
  const Provenance whole = read_provenance(invert(all) / "provenance.json");
  EXPECT_TRUE(whole.left_out.empty());
  EXPECT_TRUE(whole.facts.contains("left out"));
  EXPECT_EQ(read_file(folder_ / "saved/rerender.exr"), read_file(folder_ / "everything/rerender.exr"));
}

// SSRT cell by cell and by the pyramid: the same hits, and so the same picture.
TEST_F(InvertTest, BothMarchesHitEquallyOften) {
  const Scene scene = read_run(invert(options("marches")));
  Device device = Device::open();
  const auto marched = [&](const char* solver) {
    RenderSettings settings;
    settings.light = "image", settings.spp = 16, settings.ssrt = solver;
    return render_scene(device, scene, settings);
  };
  const Rendering cells = marched("dda"), pyramid = marched("hierarchical");
  EXPECT_EQ(cells.rays, pyramid.rays);
  EXPECT_EQ(cells.hits, pyramid.hits);
  EXPECT_GT(cells.hits, 0.3 * cells.rays);
  EXPECT_LT(cells.hits, 0.9 * cells.rays);
  EXPECT_EQ(cells.radiance.data, pyramid.radiance.data);
}

TEST_F(InvertTest, ABallIsSeenCastsAShadowAndLeavesTheRestAlone) {
  const fs::path run = invert(options("ball"));
  const Scene scene = read_run(run);
  // Halfway to what the middle of the picture shows.
  const double depth = 0.5 * scene.depth.at(0, 24, 32), radius = 0.12 * depth;
  const Vec3 center = scene.camera.unproject(32.5, 24.5, depth);
  InsertOptions o;
  o.run = run, o.command = {"clerestory", "insert"};
  InsertedObject ball;
  ball.at_point = {center.x, center.y, center.z}, ball.radius = radius, ball.roughness = 0.05;
  o.objects = {ball};
  insert(o);
  const Image composite = read_map(run / "composite.exr", 3);
  EXPECT_TRUE(fs::exists(run / "composite.png"));

  Device device = Device::open();
  TraceObjects objects(device, place_objects(scene, o.objects));
  const SceneWithObjects with = put_before(device, scene, objects, o.objects);
  // A disc of angular radius asin(r / d): its share of the picture to within its outline of pixels.
  const double pixels = sum(with.shows.data),
               half = scene.camera.fx * radius / std::sqrt(depth * depth - radius * radius);
  EXPECT_NEAR(pixels, M_PI * half * half, 2 * M_PI * half);
  EXPECT_EQ(with.shows.at(0, 24, 32), 1);
  // Facets stand off the ball by 2e-3 of its radius; half a pixel off the axis a cosine is 1 - 1e-4.
  EXPECT_NEAR(with.scene.depth.at(0, 24, 32), depth - radius, 2e-3 * radius);
  EXPECT_NEAR(with.scene.normal.at(2, 24, 32), 1, 2e-3);

  // Where nothing is known of the depth it shows, too, and a lamp behind it shines no more.
  Scene hole = scene;
  hole.depth.at(0, 24, 32) = 0, hole.material.at(2, 24, 32) = 1;
  const SceneWithObjects covered = put_before(device, hole, objects, o.objects);
  EXPECT_EQ(covered.shows.at(0, 24, 32), 1);
  EXPECT_EQ(covered.scene.material.at(2, 24, 32), 0);

  long changed = 0, total = 0;
  for (std::size_t i = 0; i < scene.photo.pixels(); ++i) {
    if (with.shows.data[i] > 0) continue;
    ++total;
    changed += std::abs(composite.data[i] - scene.photo.data[i]) > 0.02 * scene.photo.data[i] + 1e-3;
  }
  EXPECT_GT(changed, 0) << "neither shadow nor reflection";
  EXPECT_LT(changed, total);
}

TEST_F(InvertTest, AShadowTakesTheSameShareOfLightOfAnyPhotograph) {
  // One constant light over one room, three photographs: the layer's own, that one mirrored, and one twenty times as
  // bright, beside which what the layer's shadows take is little.
  Scene scene = read_run(invert(options("shadow")));
  std::fill_n(scene.material.plane(2), scene.photo.pixels(), 0.0f);
  RenderSettings settings;
  settings.light = "constant", settings.constant = {1, 1, 1};
  Device device = Device::open();
  scene.photo = render_scene(device, scene, settings).radiance;
  Scene mirrored = scene, bright = scene;
  for (float& v : bright.photo.data) v *= 20;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < scene.height(); ++y)
      for (int x = 0; x < scene.width(); ++x) mirrored.photo.at(c, y, x) = scene.photo.at(c, y, scene.width() - 1 - x);
  InsertedObject ball;
  ball.at = {32, 40}, ball.radius = 0.2 * scene.scale(), ball.albedo = {0, 0, 0}, ball.roughness = 1;
  const Insertion a = insert_into(device, scene, {ball}, settings, 2),
                  b = insert_into(device, mirrored, {ball}, settings, 2),
                  d = insert_into(device, bright, {ball}, settings, 2);

  const std::size_t n = scene.photo.pixels();
  long darker = 0;
  for (std::size_t i = 0; i < a.composite.data.size(); ++i) {
    if (a.covers.data[i % n] > 0) continue;
    const double left = a.composite.data[i] / scene.photo.data[i], other = b.composite.data[i] / mirrored.photo.data[i];
    if (std::max(left, other) > 0.75) continue;  // faint changes are added as they are
    ++darker;
    ASSERT_NEAR(left, other, 32 * kFloatRounding) << i;  // of composite and photograph, and of the layer in them
    ASSERT_NEAR(left, d.composite.data[i] / bright.photo.data[i], 32 * kFloatRounding) << i;
  }
  EXPECT_GT(darker, 50);
}

// Rays of 48 pixels with 64 samples have the shape of a picture of 64x48.
TEST_F(InvertTest, ChunksOfThePicturesOwnShapeAreNotTakenForIt) {
  const Scene scene = read_run(invert(options("shape")));
  ASSERT_EQ(scene.width(), 64);
  ASSERT_EQ(scene.height(), 48);
  InsertedObject ball;
  ball.at = {32, 40}, ball.radius = 0.2 * scene.scale();
  RenderSettings settings;
  settings.light = "image", settings.spp = 64;
  Device device = Device::open();
  const auto composite = [&](int chunk_rays) {
    settings.chunk_rays = chunk_rays;
    return insert_into(device, scene, {ball}, settings, 3).composite.data;
  };
  EXPECT_EQ(composite(48 * 64), composite(64 * 64));
}

TEST_F(InvertTest, PassesGiveObjectsSmoothEdges) {
  // A dark ball in the middle of a grey picture under constant light: a pixel is as dark as the ball covers it.
  constexpr float kGrey = 0.5f;
  Scene scene = read_run(invert(options("edges")));
  std::fill(scene.photo.data.begin(), scene.photo.data.end(), kGrey);
  std::fill_n(scene.material.plane(2), scene.photo.pixels(), 0.0f);
  const double depth = 0.5 * scene.depth.at(0, 24, 32), radius = 0.12 * depth;
  const Vec3 center = scene.camera.unproject(32.5, 24.5, depth);
  InsertedObject ball;
  ball.at_point = {center.x, center.y, center.z}, ball.radius = radius;
  ball.albedo = {0.2, 0.2, 0.2}, ball.roughness = 1, ball.metallic = 0;
  RenderSettings settings;
  settings.light = "constant", settings.spp = 128;
  Device device = Device::open();
  const Insertion hard = insert_into(device, scene, {ball}, settings, 2),
                  soft = insert_into(device, scene, {ball}, settings, 2, 8);
  EXPECT_EQ(soft.composite.data, insert_into(device, scene, {ball}, settings, 2, 8).composite.data);

  // The disc that the ball is seen as, nearly: its middle is that of pixel (32, 24).
  const double half = scene.camera.fx * radius / std::sqrt(depth * depth - radius * radius);
  const auto covered = [&](int x, int y) {
    constexpr int kFine = 32;
    int inside = 0;
    for (int k = 0; k < kFine * kFine; ++k)
      inside += std::hypot(x - 32.5 + (k % kFine + 0.5) / kFine, y - 24.5 + (k / kFine + 0.5) / kFine) < half;
    return inside / static_cast<double>(kFine * kFine);
  };
  double error = 0, hard_error = 0;
  int edge = 0;
  for (int y = 0; y < scene.height(); ++y)
    for (int x = 0; x < scene.width(); ++x) {
      const double share = soft.covers.at(0, y, x), truth = covered(x, y);
      EXPECT_TRUE(hard.covers.at(0, y, x) == 0 || hard.covers.at(0, y, x) == 1);
      if (truth == 0 || truth == 1) continue;
      ++edge;
      error += std::abs(share - truth), hard_error += std::abs(hard.covers.at(0, y, x) - truth);
      // The ball reflects 0.2 to 0.3 of the light; the room behind is a few percent darker for it.
      EXPECT_NEAR(soft.composite.at(1, y, x), kGrey * (1 - 0.75 * share), 0.12 * kGrey) << x << "," << y;
    }
  EXPECT_GT(edge, 20);
  EXPECT_LT(error, 0.4 * hard_error) << "eight points tell a half-plane's share to an eighth or so, one to a quarter";
}

TEST_F(InvertTest, ObjectsGetSamplesUntilTheirErrorIsTheOneAskedFor) {
  const Scene scene = read_run(invert(options("until")));
  InsertedObject ball;
  ball.at = {32, 40}, ball.radius = 0.15 * scene.scale(), ball.roughness = 0.4;
  RenderSettings settings;
  settings.sampler = "guided", settings.spp = 2048, settings.seed = 77;
  Device device = Device::open();
  const Insertion truth = insert_into(device, scene, {ball}, settings, 2, 8);
  EXPECT_TRUE(truth.rounds.empty());
  settings.spp = 16;
  double measured = 0, had = 0;
  constexpr int kSeeds = 4;
  for (int k = 0; k < kSeeds; ++k) {
    settings.seed = static_cast<std::uint32_t>(100 * k);
    const Insertion until = insert_until(device, scene, {ball}, settings, 2, {.error = 0.06});
    ASSERT_GE(until.rounds.size(), 2u);
    EXPECT_LE(until.rounds.back().error, 0.06);
    EXPECT_GT(until.rounds[until.rounds.size() - 2].error, until.rounds.size() > 2 ? 0.06 : NAN);
    double sum = 0, count = 0;
    const std::size_t n = scene.photo.pixels();
    for (std::size_t i = 0; i < until.composite.data.size(); ++i) {
      if (truth.covers.data[i % n] < 1) continue;  // at its edge both have points of their own
      const double y = truth.composite.data[i];
      sum += std::pow(until.composite.data[i] - y, 2) / (y * y + 0.01), ++count;
    }
    ASSERT_GT(count, 100);
    measured += std::pow(until.rounds.back().error, 2) / kSeeds, had += sum / count / kSeeds;
  }
  // Who stops at a small error has more than he measured, of Sobol's points he has less; the edge is left out.
  EXPECT_LT(std::sqrt(had / measured), 1.4);
  EXPECT_GT(std::sqrt(had / measured), 0.4);

  const Insertion brief = insert_until(device, scene, {ball}, settings, 2, {.seconds = 1e-6});
  EXPECT_EQ(brief.rounds.size(), 2u);
  EXPECT_EQ(brief.rounds.back().spp, 32);
  settings.spp = 20;
  EXPECT_THROW(insert_until(device, scene, {ball}, settings, 2, {.error = 0.1}), Error);
}

TEST_F(InvertTest, ObjectsThatCannotBePlacedAreRefused) {
  const Scene scene = read_run(invert(options("places")));
  const auto refused = [&](auto change) {
    InsertedObject o;
    o.at = {32, 24}, o.radius = 0.1;
    change(o);
    EXPECT_THROW(place_objects(scene, {o}), Error);
  };
  refused([](InsertedObject& o) { o.at = {64, 3}; });
  refused([](InsertedObject& o) { o.radius = 1e3; });
  refused([](InsertedObject& o) { o.radius = 0; });
  refused([](InsertedObject& o) { o.at.reset(), o.at_point = {0, 0, 1}; });
  refused([](InsertedObject& o) { o.radius.reset(), o.mesh = "nowhere.glb", o.size = 0.2; });
}

}  // namespace
}  // namespace clerestory
