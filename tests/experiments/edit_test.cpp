// Edits of a small generated room with true maps: what changes, what must not, and what is refused.
#include "experiments/applications/edit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "experiments/applications/run_folder.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/commands/edit.hpp"
#include "experiments/evaluation/picture_error.hpp"
#include "experiments/studies/edit_study.hpp"
#include "experiments/studies/truth_study.hpp"
#include "experiments/truth/traced_room.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/statistics.hpp"
#include "tests/experiments/bare_room.hpp"
#include "tests/experiments/program.hpp"
#include "tests/message_of.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// One box room, made once, and a folder for results.
class EditTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / fmt::format("clerestory-edit-{}", ::getpid());
    fs::create_directories(folder_);
    device_.emplace(Device::open());
    const fs::path view = make_bare_room(*device_, folder_ / "rooms", 32);
    scene_ = scene_of(read_view(view), view.string());
    settings_.spp = 32;
  }
  static void TearDownTestSuite() { device_.reset(), fs::remove_all(folder_); }

  /// Pixels whose surface is level and no higher than a hand above the lowest.
  static std::vector<bool> floor() {
    std::vector<bool> is(scene_.photo.pixels());
    std::vector<double> height(is.size());
    double lowest = std::numeric_limits<double>::infinity();
    for (int y = 0; y < scene_.height(); ++y)
      for (int x = 0; x < scene_.width(); ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * scene_.width() + x;
        const Vec3 up = scene_.camera.direction_to_world(
            {scene_.normal.at(0, y, x), scene_.normal.at(1, y, x), scene_.normal.at(2, y, x)});
        height[i] = scene_.camera.to_world(scene_.camera.unproject(x + 0.5, y + 0.5, scene_.depth.at(0, y, x))).y;
        is[i] = up.y > 0.99 && scene_.depth.at(0, y, x) > 0;
        if (is[i]) lowest = std::min(lowest, height[i]);
      }
    for (std::size_t i = 0; i < is.size(); ++i) is[i] = is[i] && height[i] < lowest + 0.1;
    return is;
  }
  static Image mask_of(const std::vector<bool>& pixels) {
    Image mask(scene_.width(), scene_.height(), 1);
    std::transform(pixels.begin(), pixels.end(), mask.data.begin(), [](bool p) { return p ? 1.0f : 0.0f; });
    return mask;
  }
  static MaterialEdit mirror() { return {{{0.9, 0.9, 0.9}}, 0.02, 1.0}; }
  static Edit edited(const Scene& scene, const Image& mask, const MaterialEdit& change, int bounces,
                     const std::string& light = "image", const std::vector<SoftLamp>& lamps = {}) {
    RenderSettings settings = settings_;
    settings.light = light, settings.lamps = lamps;
    return edit_scene(*device_, scene, mask, change, settings, bounces);
  }

  static inline fs::path folder_;
  static inline std::optional<Device> device_;
  static inline Scene scene_;
  static inline RenderSettings settings_;
};

TEST_F(EditTest, EqualSeedsEqualBits) {
  const Image mask = mask_of(floor());
  const Edit a = edited(scene_, mask, mirror(), 3), b = edited(scene_, mask, mirror(), 3);
  EXPECT_EQ(a.composite.data, b.composite.data);
  ASSERT_EQ(a.bounces.size(), 3u);
  EXPECT_GT(a.shown, 0.02) << "the view shows no floor: the tests see nothing";
}

TEST_F(EditTest, ValuesThatAreThereChangeNothing) {
  Scene scene = scene_;
  const std::size_t n = scene.photo.pixels();
  const std::vector<bool> floor_pixels = floor();
  for (std::size_t i = 0; i < n; ++i) {
    if (!floor_pixels[i]) continue;
    for (std::size_t c = 0; c < 3; ++c) scene.albedo.data[c * n + i] = 0.3f;
    scene.material.data[i] = 0.4f, scene.material.data[n + i] = 0, scene.material.data[2 * n + i] = 0;
  }
  const Edit same = edited(scene, mask_of(floor_pixels), {{{0.3, 0.3, 0.3}}, 0.4, 0.0}, 2);
  EXPECT_EQ(same.composite.data, scene.photo.data);
  EXPECT_EQ(same.shown, 0);
  EXPECT_EQ(same.bounces.size(), 1u) << "nothing is thrown on";
}

// The light that falls on a repainted surface is the photograph's: with specular part s, which paint does not change,
// each channel shows s + k (photo - s), k the ratio of albedos.
TEST_F(EditTest, PaintScalesTheDiffusePartOfThePhotograph) {
  Scene scene = scene_;
  const std::size_t n = scene.photo.pixels();
  const std::vector<bool> floor_pixels = floor();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t c = 0; c < 3; ++c) scene.albedo.data[c * n + i] = 0.8f;
    scene.material.data[n + i] = 0, scene.material.data[2 * n + i] = 0;
  }
  const auto painted = [&](double albedo) {
    return edited(scene, mask_of(floor_pixels), {{{albedo, albedo, albedo}}, {}, {}}, 1).composite;
  };
  const Image half = painted(0.4), quarter = painted(0.2);
  double compared = 0;
  for (std::size_t i = 0; i < half.data.size(); ++i) {
    const double photo = scene.photo.data[i], once = photo - half.data[i], twice = photo - quarter.data[i];
    if (!floor_pixels[i % n]) {
      ASSERT_EQ(half.data[i], scene.photo.data[i]) << "bounce 1 stays under the mask";
      continue;
    }
    if (once == 0) continue;  // all that is seen is specular
    // (1 - 1/4) / (1 - 1/2). A few sums of values up to the photograph's, rounded to float.
    ASSERT_NEAR(twice, 1.5 * once, 16 * 0x1p-24 * photo) << i;
    ASSERT_GT(once, -16 * 0x1p-24 * photo) << "darker paint is brighter";
    ASSERT_LE(once, 0.5 * photo * (1 + 16 * 0x1p-24));
    ++compared;
  }
  EXPECT_GT(compared, 0.02 * 3 * n);
}

// One bright pixel of an old paint that lacks blue, or all colour, painted grey: the light on it, which is grey, comes
// from the channels that show it, and from the layer when none does.
TEST_F(EditTest, DarkPaintDoesNotHideTheLightOnIt) {
  const std::vector<bool> floor_pixels = floor();
  const std::size_t n = scene_.photo.pixels();
  const std::size_t at =
      static_cast<std::size_t>(std::find(floor_pixels.begin(), floor_pixels.end(), true) - floor_pixels.begin());
  std::vector<bool> one(n, false);
  one[at] = true;
  const auto painted = [&](const std::array<float, 3>& old, float light) {
    Scene scene = scene_;
    scene.material.data[n + at] = scene.material.data[2 * n + at] = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      scene.albedo.data[c * n + at] = old[c];
      scene.photo.data[c * n + at] = old[c] > 0 ? old[c] * light : light;
    }
    return std::pair{edited(scene, mask_of(one), {{{0.5, 0.5, 0.5}}, 0.8, 0.0}, 1, "constant"), scene};
  };
  const Image yellow = painted({0.6f, 0.6f, 0.01f}, 1e4f).first.composite;
  // The specular part, at most the ambient of a few units (the pixel's own share of it is 1e4 / 3072), hides in 100.
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(yellow.data[c * n + at], 5000, 0.05 * 5000) << c;

  const auto [black, scene] = painted({0, 0, 0}, 1e4f);
  Scene after = black.with.scene;
  RenderSettings settings = settings_;
  settings.light = "constant";
  const Image layer = render_scene(*device_, after, settings).radiance;
  for (std::size_t c = 0; c < 3; ++c)
    // A difference of two renders added again: a few roundings, and those of taking the photograph away and adding it.
    EXPECT_NEAR(black.composite.data[c * n + at], layer.data[c * n + at], 8 * 0x1p-24 * 1e4);
}

// A white mirror under the same light from everywhere shows that light.
TEST_F(EditTest, WhiteMirrorInAFurnace) {
  const std::vector<bool> floor_pixels = floor();
  const Edit e = edited(scene_, mask_of(floor_pixels), {{{1, 1, 1}}, 0.02, 1.0}, 1, "constant");
  const std::array<double, 3> ambient = ambient_of(scene_);
  const std::size_t n = scene_.photo.pixels();
  for (std::size_t c = 0; c < 3; ++c) {
    CompensatedSum sum;
    double count = 0;
    for (std::size_t i = 0; i < n; ++i)
      if (floor_pixels[i]) sum.add(e.composite.data[c * n + i]), ++count;
    // Samples of the cosine lobe, one in ten, find nothing: their number is stratified to one sample in 32 of a pixel,
    // uniformly off, 1 / (32 sqrt(12)); four deviations of the mean. Masking costs alpha^2 = 2e-7.
    EXPECT_NEAR(sum.value() / count / ambient[c], 1, 4 / (32 * std::sqrt(12 * count)) + 1e-3);
  }
}

// The contract: the render of the edited scene under the mask, elsewhere the photograph plus the render with less the
// render without. Emitters show the layer's render alone under the mask; flags are asked by the ambient only, which one
// pixel that the edit leaves alone decides here.
TEST_F(EditTest, CompositeIsThePhotographPlusWithLessWithout) {
  Scene scene = scene_;
  const std::size_t n = scene.photo.pixels();
  const std::vector<bool> floor_pixels = floor();
  const std::size_t still =
      static_cast<std::size_t>(std::find(floor_pixels.rbegin(), floor_pixels.rend(), true) - floor_pixels.rbegin());
  const std::size_t kept = n - 1 - still;  // a floor pixel: no ray of it ends on the floor
  std::vector<bool> masked = floor_pixels;
  masked[kept] = false;
  std::fill(scene.material.plane(2), scene.material.plane(2) + n, 1.0f);
  scene.material.plane(2)[kept] = 0;

  const MaterialEdit metal{{{0.8, 0.6, 0.3}}, 0.4, 1.0};
  const Edit once = edited(scene, mask_of(masked), metal, 1), twice = edited(scene, mask_of(masked), metal, 2);
  ASSERT_EQ(twice.composite.data[kept], scene.photo.data[kept]);
  const auto render = [&](const Image& maps_of, const Image& material, const Image& light) {
    Scene lit = scene;
    lit.albedo = maps_of, lit.material = material, lit.photo = light;
    std::copy(scene.material.plane(2), scene.material.plane(2) + n, lit.material.plane(2));
    return render_scene(*device_, lit, settings_).radiance;
  };
  const Image with = render(twice.with.scene.albedo, twice.with.scene.material, once.composite);
  const Image without = render(scene.albedo, scene.material, scene.photo);
  double equal = 0, changed = 0;
  for (std::size_t i = 0; i < with.data.size(); ++i) {
    const double photo = scene.photo.data[i];
    const double expected =
        masked[i % n] ? with.data[i] : std::max(photo + static_cast<double>(with.data[i]) - without.data[i], 0.0);
    // Two sums of 32 samples in lanes and a few additions: 64 half ulps of the largest of the values.
    const double scale = std::max({photo, static_cast<double>(with.data[i]), static_cast<double>(without.data[i])});
    equal += std::abs(twice.composite.data[i] - expected) <= 64 * 0x1p-24 * scale;
    changed += !masked[i % n] && twice.composite.data[i] != scene.photo.data[i];
  }
  // Rays start from the same points by another kernel: at the border of two cells one may end on the neighbour.
  EXPECT_GT(equal / static_cast<double>(with.data.size()), 0.99);
  EXPECT_GT(changed, 0.1 * n) << "the edit throws no light on others: the test sees nothing";
}

TEST_F(EditTest, WhatDoesNotSeeTheMaskStaysAsItIs) {
  const std::vector<bool> floor_pixels = floor();
  const std::size_t n = floor_pixels.size();
  std::vector<bool> left = floor_pixels;
  double others = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (static_cast<int>(i) % scene_.width() >= scene_.width() / 2) left[i] = false;
    others += floor_pixels[i] && !left[i];
  }
  ASSERT_GT(others, 20);
  const SoftLamp lamp{{0, 3, 1}, 1, {5, 5, 5}};  // above and behind the camera: it is the same before and after
  for (const auto& [light, lamps] :
       {std::pair{"image", std::vector<SoftLamp>{}}, {"image", {lamp}}, {"constant", {lamp}}}) {
    const Edit e = edited(scene_, mask_of(left), mirror(), 2, light, lamps);
    bool elsewhere = false;
    for (std::size_t i = 0; i < e.composite.data.size(); ++i) {
      if (left[i % n]) continue;
      // Rays leave the floor upwards and cells that face away are not hit: in two bounces floor throws nothing on
      // floor.
      if (floor_pixels[i % n])
        ASSERT_EQ(e.composite.data[i], scene_.photo.data[i]) << light << ", lamps " << lamps.size();
      else
        elsewhere = elsewhere || e.composite.data[i] != scene_.photo.data[i];
    }
    EXPECT_TRUE(elsewhere);
  }
}

TEST_F(EditTest, AMaskWithoutAnySurfaceIsRefused) {
  Scene scene = scene_;
  const std::vector<bool> floor_pixels = floor();
  for (std::size_t i = 0; i < floor_pixels.size(); ++i)
    if (floor_pixels[i]) scene.depth.data[i] = 0;
  EXPECT_THAT(message_of<Error>([&] { apply_edit(scene, mask_of(floor_pixels), mirror()); }),
              testing::AllOf(HasSubstr("no depth"), HasSubstr("--mask")));
}

TEST_F(EditTest, AnEditedEmitterStopsEmitting) {
  Scene scene = scene_;
  const std::size_t n = scene.photo.pixels();
  const std::vector<bool> floor_pixels = floor();
  for (std::size_t i = 0; i < n; ++i) {
    if (!floor_pixels[i]) continue;
    scene.material.data[2 * n + i] = 1;
    for (std::size_t c = 0; c < 3; ++c) scene.photo.data[c * n + i] = 50;
  }
  const Edit e = edited(scene, mask_of(floor_pixels), {{{0.5, 0.5, 0.5}}, 0.8, 0.0}, 2);
  double darker = 0, lit = 0, others = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (floor_pixels[i]) {
      ASSERT_EQ(e.with.scene.material.data[2 * n + i], 0);
      ASSERT_LT(e.composite.data[i], 10) << "still bright";
      continue;
    }
    ++others, darker += e.composite.data[i]<scene.photo.data[i], lit += e.composite.data[i]> scene.photo.data[i];
  }
  EXPECT_GT(darker, 0.3 * others) << "what it lit is as bright as before";
  EXPECT_EQ(lit, 0);
}

TEST_F(EditTest, TakesSamplesUntilTheErrorUnderTheMaskIsTheOneAskedFor) {
  const Image mask = mask_of(floor());
  const MaterialEdit brushed{{{0.9, 0.9, 0.9}}, 0.4, 1.0};
  RenderSettings settings = settings_;
  settings.spp = 4096, settings.seed = 77, settings.sampler = "guided";
  const Edit truth = edit_scene(*device_, scene_, mask, brushed, settings, 2);
  EXPECT_TRUE(truth.rounds.empty());
  const std::size_t n = scene_.photo.pixels();
  double measured = 0, had = 0;
  constexpr int kSeeds = 4;
  for (int k = 0; k < kSeeds; ++k) {
    settings.spp = 16, settings.seed = static_cast<std::uint32_t>(100 * k);
    const Edit until = edit_scene(*device_, scene_, mask, brushed, settings, 2, RenderGoal{.error = 0.06});
    ASSERT_GE(until.rounds.size(), 2u);
    EXPECT_LE(until.rounds.back().error, 0.06);
    EXPECT_EQ(until.bounces.size(), 2u);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < until.composite.data.size(); ++i) {
      if (mask.data[i % n] == 0) continue;
      const double y = truth.composite.data[i];
      sum += std::pow(until.composite.data[i] - y, 2) / (y * y + 0.01), ++count;
    }
    measured += std::pow(until.rounds.back().error, 2) / kSeeds, had += sum / count / kSeeds;
  }
  // Who stops at a small error has more than he measured; of Sobol's points he has less.
  EXPECT_LT(std::sqrt(had / measured), 1.4);
  EXPECT_GT(std::sqrt(had / measured), 0.4);

  // Two rounds of equal numbers are as many samples: what is not linear is done to their mean.
  settings.spp = 16;
  const Edit brief = edit_scene(*device_, scene_, mask, brushed, settings, 2, RenderGoal{.seconds = 1e-6});
  ASSERT_EQ(brief.rounds.size(), 2u);
  EXPECT_EQ(brief.rounds.back().spp, 32);
  const double once = edit_scene(*device_, scene_, mask, brushed, settings, 2).bounces[0].rays;
  EXPECT_NEAR(brief.bounces[0].rays, 2 * once, 0.01 * once) << "few directions are below the surface, by chance";
  settings.spp = 20;
  EXPECT_THROW(edit_scene(*device_, scene_, mask, brushed, settings, 2, RenderGoal{.error = 0.1}), Error);
}

// The study's truth: a room whose floor is a mirror, traced. The edit comes closer to it than the photograph is.
TEST_F(EditTest, AMirrorFloorIsLikeTheTracersRoom) {
  const Room room = make_box_room(3);
  TraceScene traced(*device_, room.scene);
  const Camera camera = choose_views(traced, room, 1, 48, 36, Random(5)).at(0);
  const TraceMaps maps = traced.maps(camera);
  Scene scene = scene_of(maps, camera);
  scene.photo = traced.picture(camera, 64, 1).mean;

  const MaterialEdit& change = edit_cases().at(0).change;
  const int material = material_of_surface(room, camera, maps, EditedSurface::Floor, 0.02);
  ASSERT_GE(material, 0);
  EXPECT_EQ(material_of_surface(room, camera, maps, EditedSurface::Floor, 1.1), -1) << "no surface shows so much";
  EXPECT_NE(material_of_surface(room, camera, maps, EditedSurface::Wall, 0.02), material);
  const Image mask = mask_of_material(room.scene, maps, material);
  TraceScene changed(*device_, with_material(room.scene, material, change));
  const TraceMaps true_maps = changed.maps(camera);
  const Edit done = edited(scene, mask, change, 2);
  const std::size_t n = mask.pixels();
  std::vector<bool> under(n);
  for (std::size_t i = 0; i < n; ++i) {
    under[i] = mask.data[i] > 0;
    for (std::size_t c = 0; c < 3; ++c)
      // Three weights of one value add up to it, to a few roundings.
      ASSERT_NEAR(done.with.scene.albedo.data[c * n + i], true_maps.albedo.data[c * n + i], 8 * 0x1p-24);
    ASSERT_NEAR(done.with.scene.material.data[i], true_maps.roughness.data[i], 8 * 0x1p-24);
  }
  const Image truth = changed.picture(camera, 64, 1).mean;
  EXPECT_LT(picture_error(done.composite, truth, under).relmse, picture_error(scene.photo, truth, under).relmse);
}

TEST_F(EditTest, WritesARunThatCanBeEditedAgain) {
  const fs::path run = folder_ / "run";
  fs::create_directories(run);
  write_run(run, scene_, std::nullopt);
  write_png(folder_ / "floor.png", mask_of(floor()), Encoding::Linear);
  EditOptions o;
  o.run = run, o.mask = folder_ / "floor.png", o.change = mirror(), o.render = settings_;
  o.command = {"clerestory", "edit"};
  const std::string summary = edit(o);
  EXPECT_THAT(summary, HasSubstr("\"bounces\""));
  for (const char* name : {"composite.exr", "composite.png", "albedo.exr", "material.exr", "normal.exr", "depth.exr",
                           "photo.exr", "camera.json", "mask.png", "report.html", "provenance.json"})
    EXPECT_TRUE(fs::exists(run / "edit" / name)) << name;
  EXPECT_THAT(read_file(run / "edit" / "report.html"), HasSubstr("bounces that follow the edit"));
  const Image first = read_map(run / "edit" / "composite.exr", 3);
  EXPECT_EQ(read_run(run / "edit").photo.data, first.data);

  EditOptions again = o;
  again.run = run / "edit", again.change = {{}, 0.5, {}};
  edit(again);
  EXPECT_NE(read_map(run / "edit" / "edit" / "composite.exr", 3).data, first.data);
}

TEST_F(EditTest, BadInputIsRefusedAndNothingIsWritten) {
  const fs::path run = folder_ / "refusing", partial = folder_ / "partial";
  fs::create_directories(run), fs::create_directories(partial);
  write_run(run, scene_, std::nullopt), write_run(partial, scene_, std::nullopt);
  fs::remove(partial / "normal.exr");
  const Image mask = mask_of(floor());
  const auto png = [&](const std::string& name, const Image& image) {
    write_png(folder_ / name, image, Encoding::Linear);
    return (folder_ / name).string();
  };
  const std::string good = png("good.png", mask), small = png("small.png", Image(8, 8, 1, 1)),
                    empty = png("empty.png", Image(64, 48, 3, 0.49f));
  write_file(folder_ / "noise.png", "not a picture");
  const std::vector<std::string> files = files_below(folder_);

  struct Case {
    std::vector<std::string> words;
    std::string says;
  };
  const std::string at = run.string();
  const std::vector<Case> cases{{{at, "--roughness", "0.1"}, "--mask"},
                                {{at, "--mask", good}, "no change is asked for"},
                                {{at, "--mask", small, "--roughness", "0.1"}, "another size"},
                                {{at, "--mask", empty, "--roughness", "0.1"}, "empty"},
                                {{at, "--mask", (folder_ / "noise.png").string(), "--roughness", "0.1"}, "noise.png"},
                                {{at, "--mask", (folder_ / "none.png").string(), "--roughness", "0.1"}, "none.png"},
                                {{at, "--mask", good, "--roughness", "1.5"}, "--roughness"},
                                {{at, "--mask", good, "--metallic", "nan"}, "--metallic"},
                                {{at, "--mask", good, "--albedo", "0.5,0.5"}, "--albedo"},
                                {{at, "--mask", good, "--albedo", "0.5,-0.1,0.5"}, "--albedo"},
                                {{at, "--mask", good, "--roughness", "0.1", "--bounces", "0"}, "--bounces"},
                                {{at, "--mask", good, "--roughness", "0.1", "--light", "sun"}, "--light"},
                                {{at, "--mask", good, "--roughness", "0.1", "--spp", "1"}, "--spp"},
                                {{partial.string(), "--mask", good, "--roughness", "0.1"}, "normal"},
                                {{(folder_ / "nowhere").string(), "--mask", good, "--roughness", "0.1"}, "nowhere"}};
  for (const Case& c : cases) {
    std::vector<const char*> words{"clerestory", "edit"};
    for (const std::string& word : c.words) words.push_back(word.c_str());
    CommandLine line;
    add_edit_command(line);
    testing::internal::CaptureStderr();
    EXPECT_EQ(line.run(static_cast<int>(words.size()), words.data()), 2) << c.says;
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr(c.says));
  }
  EXPECT_EQ(files_below(folder_), files);
}

}  // namespace
}  // namespace clerestory
