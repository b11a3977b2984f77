// What a re-render leaves out: what is exact changes no bit, what a scene has no need of is named, and times are taken.
#include "nets/scene_traits.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/nets/corner.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

struct SceneTraitsTest : testing::Test {
  Device device = device_for(Precision::Single);
  Scene scene = corner();
  RenderSettings settings;
  SceneTraitsTest() {
    settings.spp = 32, settings.seed = 5;
    // Normals as nets predict them: not those of the depth.
    for (int y = 0; y < scene.height(); ++y)
      for (int x = 0; x < scene.width(); ++x)
        for (int c = 0; c < 3; ++c)
          scene.normal.at(c, y, x) += static_cast<float>(0.4 * noise(y / 4 * 97 + x / 4, 20 + c) - 0.2);
  }

  std::vector<Saving> in_effect(const RenderSettings& s) {
    std::vector<Saving> found;
    for (const Saved& saved : saved_in(traits_of(scene, s), s, render_scene(device, scene, s)))
      found.push_back(saved.saving);
    return found;
  }
};

TEST_F(SceneTraitsTest, WhatIsExactChangesNoBit) {
  for (const std::string light : {"image", "constant"}) {
    settings.light = light;
    const Rendering less = render_scene(device, scene, settings);
    for (const SavingKind& kind : kSavings) {
      if (!kind.exact) continue;
      RenderSettings whole = settings;
      whole.leave_out.erase(kind.saving);
      const Rendering all = render_scene(device, scene, whole);
      EXPECT_EQ(less.radiance.data, all.radiance.data) << light << ": " << kind.name;
      EXPECT_EQ(less.standard_error.data, all.standard_error.data) << light << ": " << kind.name;
      if (kind.saving != Saving::Tracing) {
        EXPECT_EQ(less.uncertainty.data, all.uncertainty.data) << light << ": " << kind.name;
        EXPECT_EQ(less.hits, all.hits) << light << ": " << kind.name;
      }
    }
  }
  settings.light = "constant";
  RenderSettings traced = settings;
  traced.leave_out.erase(Saving::Tracing);
  EXPECT_EQ(render_scene(device, scene, settings).hits, 0);
  EXPECT_GT(render_scene(device, scene, traced).hits, 0) << "the general program traces, whoever asks";
}

TEST_F(SceneTraitsTest, NamesWhatTheSceneGivesReasonFor) {
  using testing::ElementsAre;
  settings.light = "image";
  EXPECT_THAT(in_effect(settings), ElementsAre(Saving::Lobes));
  settings.lamps = {{{0, 3, 1}, 0.5, {1, 1, 1}}};
  EXPECT_THAT(in_effect(settings), ElementsAre());
  settings.lamps.clear(), settings.light = "constant";
  EXPECT_THAT(in_effect(settings), ElementsAre(Saving::Lobes, Saving::Tracing));
  settings.leave_out.clear();
  EXPECT_THAT(in_effect(settings), ElementsAre());
}

TEST_F(SceneTraitsTest, ReadsMapsAndLight) {
  scene.depth.data[0] = 0;
  scene.material.data[0] = 7;  // of no surface
  for (std::size_t i = 1; i <= 112; ++i) scene.material.plane(2)[i] = 1;
  settings.light = "panorama", settings.lamps.resize(3);
  const SceneTraits traits = traits_of(scene, settings);
  const double all = kCornerWidth * kCornerHeight - 1;
  EXPECT_DOUBLE_EQ(traits.surfaces, all / (all + 1));
  EXPECT_DOUBLE_EQ(traits.metals, 223 / all) << "every fifth pixel but the first";
  EXPECT_DOUBLE_EQ(traits.emitters, 112 / all);
  EXPECT_TRUE(traits.traces) << "lamps ask where rays end";
  EXPECT_EQ(traits.lamps, 3u);
  EXPECT_GT(traits.normals_off, 3);
  EXPECT_LT(normals_off_depth(corner()), 0.01) << "walls whose normals are those of their depth";
  EXPECT_GT(traits.least_roughness, 0.1);
  EXPECT_LT(traits.most_roughness, 0.9);
  EXPECT_FALSE(traits.constant_maps);
  std::ranges::fill(scene.albedo.data, 0.5f), std::ranges::fill(scene.material.data, 0.25f);
  EXPECT_TRUE(traits_of(scene, settings).constant_maps);
}

TEST_F(SceneTraitsTest, TakesTimesOfEachThatIsInEffect) {
  settings.light = "constant";
  const Rendering rendering = render_scene(device, scene, settings);
  const std::map<Saving, double> seconds = measure_savings(device, scene, settings, rendering);
  ASSERT_EQ(seconds.size(), 2u);
  EXPECT_GT(seconds.at(Saving::Tracing), 0) << "tracing takes longer than not tracing";
}

}  // namespace
}  // namespace clerestory
