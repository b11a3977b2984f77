// Learned light as the layer asks it: beside the same nets asked directly, at every tile, and what it refuses.
#include "nets/learned_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/depth_pyramid.hpp"
#include "host/ops/light/mix_light.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "nets/replay.hpp"
#include "nets/scene_radiance.hpp"
#include "tests/nets/corner.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = kCornerWidth, kHeight = kCornerHeight, kSamples = 16;
const ResnetSize kTrunk{.blocks = {1, 0, 0, 0}, .channels = {16, 0, 0, 0}, .stages = 1};

Device& device() {
  static Device d = Device::open();
  return d;
}

LightSizes small_sizes() {
  LightSizes sizes;
  sizes.in_view = {.trunk = kTrunk, .frequencies = 16, .width = 16, .layers = 3, .again = 0};
  sizes.out_of_view = {.trunk = kTrunk,
                       .hyper = HyperNet::LowRank,
                       .stem = 16,
                       .rank = 2,
                       .octaves = 3,
                       .hidden = {16, 16},
                       .march = {.segments = 8},
                       .released_output = false,
                       .log_input = true};
  return sizes;
}

/// Nets as they are before training, but for an output that says more than the photograph.
std::shared_ptr<LightNets> untrained(int longer_side, const LightSizes& sizes = small_sizes()) {
  const auto nets = std::make_shared<LightNets>();
  nets->sizes = sizes, nets->longer_side = longer_side, nets->note = "untrained";
  nets->states = std::make_shared<States>(device());
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 32, 32), nets->sizes, false)[0];
  ask_light(graph, picture, nets->sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  nets->states->initialise(graph, 7);
  Tensor out = nets->states->get("local.mlp.out.weight");
  for (double& w : out.real) w *= 20;
  nets->states->set("local.mlp.out.weight", out);
  return nets;
}

RenderSettings settings_of(const std::string& light, std::shared_ptr<const LightNets> nets) {
  RenderSettings settings;
  settings.light = light, settings.nets = std::move(nets), settings.spp = kSamples, settings.seed = 3;
  return settings;
}

/// The re-render by one graph without tiles: all rays of all pixels at once, the nets asked as in training.
std::vector<float> asked_directly(const Scene& scene, const LightNets& nets, const RenderSettings& settings) {
  const double exposure = exposure_of(scene.photo.data);
  Graph graph;
  LightSizes sizes = nets.sizes;
  sizes.out_of_view.march.jitter = false;
  const SceneValues v = scene_values(graph, scene);
  const LitPicture picture = lit_pictures(
      graph, {scale(v.photo, exposure), v.maps.depth, v.maps.surfaces, v.camera, v.range}, sizes, false)[0];
  const int pixels = kWidth * kHeight;
  const BrdfSamples drawn = sample_brdf(v.maps.depth, v.camera, v.maps.surfaces, v.maps.surfaces, pixels, kSamples,
                                        render_spec(settings).sampling);
  const Value origins = ray_origins(surface_points(v.maps.depth, v.camera), kSamples);
  std::vector<int> own;
  for (int i = 0; i < pixels * kSamples; ++i) own.push_back(i / kSamples);
  const Value skip = graph.constant(Tensor::of_int({1, 1, pixels, kSamples}, std::move(own)));
  const LightAnswer answer = ask_light(graph, picture, sizes, origins, drawn.direction, skip);
  const Value mean =
      accumulate_samples(drawn.weight, answer.mixed, drawn.pdf, answer.hits.u, answer.hits.pixel, kSamples).mean;
  Executor run(compile(graph, {mean}, device()), nets.states);
  feed_scene(run, scene);
  run.run(settings.seed);
  std::vector<float> values = run.fetch_floats(mean);
  for (float& x : values) x = static_cast<float>(x / exposure);
  return values;
}

/// The re-render and the same rays asked directly.
void expect_the_same(const LightSizes& sizes) {
  const Scene scene = corner();
  const auto nets = untrained(kWidth, sizes);  // the nets' picture is the photograph itself
  const RenderSettings settings = settings_of("net", nets);
  const Rendering render = render_scene(device(), scene, settings);
  const std::vector<float> direct = asked_directly(scene, *nets, settings);
  ASSERT_EQ(render.radiance.data.size(), direct.size());
  double largest = 0;
  for (const float v : direct) largest = std::max(largest, std::abs(static_cast<double>(v)));
  ASSERT_GT(largest, 0.1);
  // Same rays, same nets, same samples; radiance is positive, so that nothing cancels. Nets in one kernel round in
  // another order than nets of ops: some 100 products deep, thrice that with the samples' sum. A ray leaves a part of
  // the light out whose share is below kLeastShare.
  for (std::size_t i = 0; i < direct.size(); ++i)
    EXPECT_NEAR(render.radiance.data[i], direct[i], 300 * 0x1p-24 * largest + 2 * kLeastShare * std::abs(direct[i]))
        << i;
}

TEST(NetLight, TheLayerAsksWhatTrainingAsks) {
  LightSizes sizes = small_sizes();
  expect_the_same(sizes);
  sizes.out_of_view.background = true;
  expect_the_same(sizes);
  sizes.out_of_view.gain = 1.7;
  expect_the_same(sizes);
}

// A ray that leaves what is seen is brighter by the gain, one that hits for sure as it was.
TEST(NetLight, AGainIsOfTheLightOutOfViewAlone) {
  const Scene scene = corner();
  const auto plain = untrained(kWidth);
  LightNets brighter = *plain;
  brighter.sizes.out_of_view.gain = 2;
  Rays rays;
  for (const Vec3& d : {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(0.3, 0.8, 0.2), Vec3(0.1, -0.1, -1)})
    rays.points.emplace_back(0), rays.directions.push_back(normalize(d));
  const auto ask = [&](const std::string& light, std::shared_ptr<const LightNets> nets) {
    return SceneRadiance(device(), scene, settings_of(light, std::move(nets)), rays.points.size()).radiance(rays);
  };
  for (const char* light : {"net", "out_of_view"}) {
    const RadianceAnswers before = ask(light, plain), after = ask(light, std::make_shared<LightNets>(brighter));
    int far = 0, near = 0;
    for (std::size_t i = 0; i < before.radiance.size(); ++i) {
      const double u = light == std::string("net") ? before.uncertainty[i % rays.points.size()] : 1;
      far += u == 1, near += u < kLeastShare;
      if (u == 1) {
        EXPECT_FLOAT_EQ(after.radiance[i], 2 * before.radiance[i]);
      } else if (u < kLeastShare) {
        EXPECT_EQ(after.radiance[i], before.radiance[i]);
      }
    }
    EXPECT_GE(far, 3);
    EXPECT_GE(near, light == std::string("net") ? 3 : 0);
  }
}

TEST(NetLight, SoItDoesOfShellsAndOfNetsThatReadMaps) {
  LightSizes sizes = small_sizes();
  sizes.out_of_view.sees_maps = true;
  expect_the_same(sizes);
  sizes.out_of_view.form = OutOfViewForm::Shells;
  sizes.out_of_view.trunk = {.blocks = {1, 1, 1, 1}, .channels = {16, 16, 16, 16}};
  sizes.out_of_view.shells.rows = 16, sizes.out_of_view.shells.columns = 32, sizes.out_of_view.shells.code = 16;
  sizes.out_of_view.shells.channels = {16, 16, 16, 16};
  expect_the_same(sizes);
}

TEST(NetLight, SameBitsRunToRunAndWhateverTheTiles) {
  const Scene scene = corner();
  RenderSettings settings = settings_of("net", untrained(20));
  const Image first = render_scene(device(), scene, settings).radiance;
  EXPECT_EQ(render_scene(device(), scene, settings).radiance.data, first.data);
  for (const int rays : {16 * 7, 16 * 64, 16 * 1000}) {
    settings.chunk_rays = rays;
    EXPECT_EQ(render_scene(device(), scene, settings).radiance.data, first.data) << rays;
  }
}

TEST(NetLight, ManyRaysShareAnswers) {
  const Scene scene = corner();
  const auto nets = untrained(20);
  RenderSettings shared = settings_of("net", nets);
  shared.spp = 256;
  RenderSettings alone = shared;
  alone.sharing = Sharing::Never;
  const Rendering few = render_scene(device(), scene, shared), all = render_scene(device(), scene, alone);
  EXPECT_EQ(few.shared_answers, 20 * 14 * 16) << "16 around each pixel of the nets' picture";
  EXPECT_EQ(all.shared_answers, 0);
  EXPECT_TRUE(few.answered.empty()) << "to look an answer up needs no list";
  EXPECT_EQ(all.answered.size(), 2u);
  EXPECT_NE(few.radiance.data, all.radiance.data);
  shared.chunk_rays = 16 * 100;
  EXPECT_EQ(render_scene(device(), scene, shared).radiance.data, few.radiance.data) << "whatever the tiles";

  // Few rays for the picture's size ask by themselves.
  EXPECT_EQ(render_scene(device(), scene, settings_of("net", untrained(kWidth))).shared_answers, 0);

  // Nets that do not look at directions have one answer for all of them; small shares are in it on both sides.
  alone.leave_out.erase(Saving::SmallShares);
  Tensor blind = nets->states->get("local.mlp.0.direction.weight");
  std::ranges::fill(blind.real, 0.0);
  nets->states->set("local.mlp.0.direction.weight", blind);
  const Image same = render_scene(device(), scene, shared).radiance,
              each = render_scene(device(), scene, alone).radiance;
  const double largest = *std::ranges::max_element(each.data);
  ASSERT_GT(largest, 0.1);
  // Four equal answers mixed: three roundings, and in the sum of samples what Kahan leaves.
  for (std::size_t i = 0; i < each.data.size(); ++i)
    ASSERT_NEAR(same.data[i], each.data[i], 20 * 0x1p-24 * largest) << i;
}

TEST(NetLight, AmongMirrorsAnswersAreNotSharedUnlessTheyAreToBe) {
  Scene scene = corner();
  RenderSettings settings = settings_of("net", untrained(20));
  settings.spp = 256;
  const double rays = static_cast<double>(scene.photo.pixels()) * settings.spp;
  const auto with_mirrors = [&](std::size_t count) {
    for (std::size_t i = 0; i < scene.depth.pixels(); ++i) scene.material.data[i] = i < count ? 0.05f : 0.4f;
  };
  with_mirrors(scene.depth.pixels() / 2);
  EXPECT_TRUE(shares_answers(scene, settings, rays));
  EXPECT_EQ(why_none_are_shared(scene, settings, rays), "");
  with_mirrors(scene.depth.pixels() / 2 + 1);
  EXPECT_FALSE(shares_answers(scene, settings, rays));
  EXPECT_NE(why_none_are_shared(scene, settings, rays).find("50.1 % of the surfaces are mirrors"), std::string::npos);
  const Rendering each = render_scene(device(), scene, settings);
  EXPECT_EQ(each.shared_answers, 0);
  RenderSettings never = settings;
  never.sharing = Sharing::Never;
  EXPECT_EQ(each.radiance.data, render_scene(device(), scene, never).radiance.data);
  EXPECT_EQ(why_none_are_shared(scene, never, rays), "") << "not for what the scene is";
  settings.sharing = Sharing::Always;
  EXPECT_TRUE(shares_answers(scene, settings, rays));
  EXPECT_GT(render_scene(device(), scene, settings).shared_answers, 0);
  // Surfaces without a depth are none, and few rays are a reason of their own.
  settings.sharing = Sharing::WhereItPays;
  for (std::size_t i = 0; i < 2; ++i) scene.depth.data[i] = 0;
  EXPECT_TRUE(shares_answers(scene, settings, rays));
  EXPECT_NE(why_none_are_shared(scene, settings, 0.01 * rays).find("rays for each answer"), std::string::npos);
}

TEST(NetLight, CompletedIsThePhotographWhereRaysHitAndTheNetElsewhere) {
  const Scene scene = corner();
  const auto nets = untrained(kWidth);
  Rays rays;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 200; ++i) {
    rays.points.emplace_back(0.1 * unit(random), 0.1 * unit(random), -0.1);
    rays.directions.push_back(normalize(Vec3(unit(random), unit(random), 0.65 * unit(random) - 0.35)));
  }
  const auto ask = [&](const std::string& light) {
    return SceneRadiance(device(), scene, settings_of(light, nets), rays.points.size()).radiance(rays);
  };
  RenderSettings photograph = settings_of("image", nullptr);
  photograph.level = std::array<double, 3>{1, 1, 1};
  const RadianceAnswers completed = ask("completed"), far = ask("out_of_view"),
                        image = SceneRadiance(device(), scene, photograph, rays.points.size()).radiance(rays);
  const std::array<double, 3> ambient = ambient_of(scene);
  const std::size_t n = rays.points.size();
  int hits = 0, misses = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double u = completed.uncertainty[i];
    ASSERT_EQ(image.uncertainty[i], completed.uncertainty[i]);
    hits += u < 1, misses += u == 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const double seen = image.radiance[c * n + i] - u * ambient[c],
                   there = u < kLeastShare ? 0 : far.radiance[c * n + i];
      EXPECT_NEAR(completed.radiance[c * n + i], seen + u * there,
                  16 * 0x1p-24 * (1 + std::abs(there)) + kLeastShare * std::abs(far.radiance[c * n + i]))
          << i;
    }
  }
  EXPECT_GT(hits, 10);
  EXPECT_GT(misses, 50);
}

TEST(NetLight, OutOfViewDiffersOnlyWhereSomethingIsHit) {
  const Scene scene = corner();
  const auto nets = untrained(kWidth);
  const Rendering both = render_scene(device(), scene, settings_of("net", nets));
  const Rendering far = render_scene(device(), scene, settings_of("out_of_view", nets));
  int nothing = 0, differ = 0;
  for (std::size_t i = 0; i < scene.photo.data.size(); ++i) {
    const bool misses = both.uncertainty.data[i % both.uncertainty.data.size()] == 1;
    nothing += misses;
    if (misses) {
      EXPECT_EQ(both.radiance.data[i], far.radiance.data[i]) << i;
    }
    differ += both.radiance.data[i] != far.radiance.data[i];
  }
  EXPECT_GT(nothing, 0);
  EXPECT_GT(differ, 0);
}

/// Nets whose in-view answer is the photograph at the hit and whose field is dark.
std::shared_ptr<LightNets> transparent(int longer_side) {
  const auto nets = untrained(longer_side);
  nets->sizes.out_of_view.released_output = true;
  States& states = *nets->states;
  states.set("local.mlp.out.weight", Tensor(states.get("local.mlp.out.weight").shape, 0));
  for (const std::string& name : states.names())
    if (name.starts_with("global.hyper.")) states.set(name, Tensor(states.get(name).shape, 0));
  return nets;
}

TEST(NetLight, ResidualMultipliesThePhotographAtItsFullSize) {
  Scene scene = corner();
  std::fill(scene.material.plane(2), scene.material.plane(2) + scene.photo.pixels(), 1.0f);  // an ambient of nothing
  const Image image = render_scene(device(), scene, settings_of("image", nullptr)).radiance;
  const Image net = render_scene(device(), scene, settings_of("net", transparent(13))).radiance;
  double sum = 0;
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    // Exposure multiplied in and out, 16 samples; shares below kLeastShare of the photograph are left out.
    EXPECT_NEAR(net.data[i], image.data[i], (40 * 0x1p-24 + 2 * kLeastShare) * image.data[i] + 1e-7) << i;
    sum += image.data[i];
  }
  EXPECT_GT(sum, 1);
}

TEST(NetLight, IsLinearInThePhotographsUnit) {
  const Scene scene = corner();
  Scene brighter = scene;
  for (float& v : brighter.photo.data) v *= 8;  // exact: the nets then read the same bits
  const RenderSettings settings = settings_of("net", untrained(20));
  const Image a = render_scene(device(), scene, settings).radiance,
              b = render_scene(device(), brighter, settings).radiance;
  for (std::size_t i = 0; i < a.data.size(); ++i) EXPECT_NEAR(b.data[i], 8 * a.data[i], 0x1p-20 * 8 * a.data[i]) << i;
}

TEST(NetLight, MemoryDoesNotGrowWithSamples) {
  const Scene scene = corner();
  RenderSettings settings = settings_of("net", untrained(20));
  const auto peak = [&](int spp) {
    settings.spp = spp;
    device().reset_memory_peak();
    render_scene(device(), scene, settings);
    return static_cast<double>(device().memory_peak());
  };
  settings.chunk_rays = 1 << 14;
  const double few = peak(64), many = peak(512);  // 5 tiles and 35
  EXPECT_LT(many, 1.02 * few);
  settings.chunk_rays = 0;  // what the light chooses: a full tile
  EXPECT_LT(peak(256) - few, 512.0 * (1 << 20));
}

TEST(NetLight, CountsWhatItsPartsAnswer) {
  const Scene scene = corner();
  const Rendering r = render_scene(device(), scene, settings_of("net", untrained(20)));
  ASSERT_EQ(r.answered.size(), 2u);
  EXPECT_EQ(r.answered[0].first, "out of view");
  EXPECT_EQ(r.answered[1].first, "in view");
  // Every ray has an answer; one that misses has it from the field, one whose hit is sure from the photograph's side.
  EXPECT_GE(r.answered[0].second + r.answered[1].second, r.rays);
  EXPECT_GE(r.answered[0].second, r.rays - r.hits);
  EXPECT_LE(r.answered[0].second, r.rays);
  EXPECT_LE(r.answered[1].second, r.hits);
  EXPECT_GT(r.answered[1].second, 0);
}

TEST(NetLight, SharesThatAreLeftOutMoveThePictureByNoMoreThanTheyAre) {
  const Scene scene = corner();
  RenderSettings settings = settings_of("net", untrained(kWidth));
  const Rendering less = render_scene(device(), scene, settings);
  settings.leave_out.erase(Saving::SmallShares);
  const Rendering all = render_scene(device(), scene, settings);
  EXPECT_TRUE(all.answered.empty()) << "each ray asks both parts";
  EXPECT_EQ(less.answered.size(), 2u);
  // Parts are at most a thousand times the photograph's white, as the residual is bounded; here none is thirty times.
  double most = 0;
  for (const float v : all.radiance.data) most = std::max(most, static_cast<double>(v));
  for (std::size_t i = 0; i < all.radiance.data.size(); ++i)
    EXPECT_NEAR(less.radiance.data[i], all.radiance.data[i], kLeastShare * 30 * most) << i;
}

TEST(NetLight, InDoubleItIsThePictureOfFloatWithMoreDigits) {
  const Scene scene = corner();
  RenderSettings settings = settings_of("net", untrained(kWidth));
  settings.lamps = {{{0.5, 2.5, 0.5}, 0.6, {4, 3, 2}}};
  const Image single = render_scene(device(), scene, settings).radiance;
  settings.precision = Precision::Double;
  const Image twice = render_scene(device(), scene, settings).radiance;
  std::vector<double> apart;
  for (std::size_t i = 0; i < single.data.size(); ++i)
    apart.push_back(std::abs(single.data[i] - twice.data[i]) / (std::abs(twice.data[i]) + 1e-3));
  // A ray on the edge between two cells may take the other in float; all else differs by some hundred roundings.
  EXPECT_LT(median(apart), 1e-5);
  EXPECT_LT(quantile(apart, 0.99), 0.05);
  EXPECT_NE(single.data, twice.data);
}

TEST(NetLight, ASampleTakenAgainIsTheOneThatWasTaken) {
  const Scene scene = corner();
  for (const Sharing sharing : {Sharing::Never, Sharing::Always}) {
    RenderSettings settings = settings_of("net", untrained(kWidth));
    settings.lamps = {{{0.5, 2.5, 0.5}, 0.6, {4, 3, 2}}}, settings.sharing = sharing;
    const Image picture = render_scene(device(), scene, settings).radiance;
    constexpr int pixel = 14 * kWidth + 21;
    double sum = 0;
    for (int s = 0; s < kSamples; ++s) {
      const std::vector<Quantity> sample = replay(device(), scene, settings, pixel, s, Precision::Single);
      sum += sample.back().values[1];
      const auto twice = replay(device(), scene, settings, pixel, s, Precision::Double);
      EXPECT_NEAR(twice.back().values[1], sample.back().values[1], 1e-3 * (std::abs(twice.back().values[1]) + 1e-3));
    }
    EXPECT_NEAR(sum, picture.plane(1)[pixel], 64 * 0x1p-24 * sum);
  }
}

TEST(NetLight, Refuses) {
  const Scene scene = corner();
  EXPECT_THROW(render_scene(device(), scene, settings_of("net", nullptr)), Error);
  EXPECT_THROW(render_scene(device(), scene, settings_of("sun", nullptr)), Error);
  const auto of_another_size = untrained(20);
  of_another_size->sizes.in_view.width = 32;
  EXPECT_THROW(render_scene(device(), scene, settings_of("net", of_another_size)), Error);
  const auto empty = untrained(20);
  empty->states = std::make_shared<States>(device());
  try {
    render_scene(device(), scene, settings_of("out_of_view", empty));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(e.what()).find("untrained: global."), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace clerestory
