// Learned light through the applications: a panorama at a point, the re-render, objects, an edit; and what is refused.
// The nets are untrained: what they say is not judged here.
#include "experiments/applications/light.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "experiments/applications/edit.hpp"
#include "experiments/applications/estimate.hpp"
#include "experiments/applications/insert.hpp"
#include "experiments/applications/invert.hpp"
#include "experiments/applications/light_choice.hpp"
#include "experiments/applications/run_folder.hpp"
#include "experiments/training/options.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/weights/light_text.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/math/panorama.hpp"
#include "host/report/progress.hpp"
#include "host/report/provenance.hpp"
#include "nets/render_scene.hpp"
#include "nets/scene_light.hpp"
#include "tests/experiments/bare_room.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// One bare room taken apart with its true maps, and a folder of weights.
struct Light : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    folder_ = std::make_unique<ScratchFolder>("clerestory-light");
    view_ = make_bare_room(Device::open(), *folder_ / "rooms", 8);
    write_untrained_light(weights());
    invert(taken_apart(run(), weights()));
  }
  static void TearDownTestSuite() { folder_.reset(), set_quiet(false); }

  static fs::path run() { return *folder_ / "run"; }
  static fs::path weights() { return *folder_ / "weights"; }

  static InvertOptions taken_apart(const fs::path& out, const fs::path& by) {
    InvertOptions i;
    i.photo = view_.string() + "_im.exr", i.gbuffer = view_, i.out = out, i.command = {"clerestory", "invert"};
    i.render.spp = 16, i.render.light = "net", i.lit_by.weights = by;
    return i;
  }
  static LightOptions options(const std::string& name) {
    LightOptions o;
    o.run = run(), o.out = *folder_ / (name + ".exr"), o.at_point = {{0.1, -0.2, -0.8}};
    o.render.light = "net", o.lit_by.weights = weights(), o.command = {"clerestory", "light"};
    return o;
  }
  static void expect_refused(LightOptions o, const std::string& words) {
    try {
      light(o);
      FAIL() << words;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      EXPECT_THAT(std::string(e.what()), testing::HasSubstr(words));
    }
    EXPECT_FALSE(fs::exists(o.out));
  }
  static inline std::unique_ptr<ScratchFolder> folder_;
  static inline fs::path view_;
};

TEST_F(Light, IsAPanoramaWhoseCentreLooksAhead) {
  const Scene scene = read_run(run());
  Device device = Device::open();
  const Size size{64, 32};
  RenderSettings settings;
  settings.light = "image";
  const Rays rays = panorama_rays({Vec3(0, 0, -1e-3), -1, ""}, size);  // beside the camera: parallax far below a pixel
  SceneRadiance light_of(device, scene, settings, rays.points.size());
  const RadianceAnswers answers = light_of.radiance(rays);
  const std::array<double, 3> ambient = ambient_of(scene);
  int inside = 0;
  for (std::size_t i = 0; i < rays.points.size(); ++i) {
    const std::optional<Vec2> at = scene.camera.project(rays.directions[i]);
    const bool seen = at && at->x > 1 && at->y > 1 && at->x < 63 && at->y < 47;
    if (seen) {
      ++inside;
      ASSERT_GE(answers.pixel[i], 0);
      EXPECT_NEAR(answers.pixel[i] % 64 + 0.5, at->x, 1) << i;
      EXPECT_NEAR(answers.pixel[i] / 64 + 0.5, at->y, 1) << i;
    } else if (!at || at->x < -1 || at->y < -1 || at->x > 65 || at->y > 49) {
      ASSERT_EQ(answers.pixel[i], -1) << i;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const float u = answers.uncertainty[i], far = static_cast<float>(ambient[c]),
                  near = answers.pixel[i] < 0 ? far : scene.photo.plane(static_cast<int>(c))[answers.pixel[i]];
      EXPECT_NEAR(answers.radiance[c * rays.points.size() + i], (1 - u) * near + u * far, 0x1p-20 * (near + far));
    }
  }
  EXPECT_GT(inside, 100);

  LightOptions o = options("image");  // the command writes the very same
  o.render.light = "image", o.at_point = {{0, 0, -1e-3}}, o.size = size;
  light(o);
  const Image panorama = read_map(o.out, 3);
  ASSERT_EQ(panorama.width, 64);
  ASSERT_EQ(panorama.height, 32);
  for (std::size_t i = 0; i < panorama.data.size(); ++i)  // stored in half precision
    ASSERT_NEAR(panorama.data[i], answers.radiance[i], 0x1p-11 * answers.radiance[i] + 0x1p-25);
  EXPECT_TRUE(fs::exists(fs::path(o.out).replace_extension(".png")));
  EXPECT_TRUE(fs::exists(fs::path(o.out).replace_extension(".json")));
}

TEST_F(Light, EqualBitsAndWhateverTheBlock) {
  LightOptions o = options("first");
  light(o);
  const std::string first = read_file(o.out);
  LightOptions again = options("again");
  again.render.chunk_rays = 1008;  // 33 blocks, the last one not full
  light(again);
  EXPECT_EQ(read_file(again.out), first);
  const Image panorama = read_map(o.out, 3);
  for (const float v : panorama.data) ASSERT_TRUE(std::isfinite(v) && v >= 0);
}

TEST_F(Light, OfAPixelIsThatJustAboveItsSurface) {
  const Scene scene = read_run(run());
  LightOptions o = options("pixel");
  o.at_point.reset(), o.at = {{20.5, 30.5}};
  const AskedPlace place = asked_place(scene, o);
  EXPECT_EQ(place.skip, 30 * 64 + 20);
  const auto [point, normal] = surface_at(scene, *o.at);
  const double rounding = 4 * kDoubleRounding * glm::length(point);
  EXPECT_NEAR(glm::distance(place.point, point), kAboveSurface, rounding);
  EXPECT_NEAR(glm::dot(place.point - point, normal), kAboveSurface * glm::length(normal), rounding);
  light(o);
  EXPECT_EQ(read_map(o.out, 3).width, 256);
}

TEST_F(Light, PlacesThatAreSpokenOfAndPlacesThatAreRefused) {
  const Scene scene = read_run(run());
  LightOptions o = options("place");
  EXPECT_EQ(asked_place(scene, o).note, "");
  o.at_point = {{0, 0, 0.5}};
  EXPECT_THAT(asked_place(scene, o).note, testing::HasSubstr("0.50 m behind the camera"));
  const double depth = scene.depth.at(0, 24, 32);
  const Vec3 behind = scene.camera.unproject(32.5, 24.5, depth + 0.2 * scene.scale());
  o.at_point = {{behind.x, behind.y, behind.z}};
  EXPECT_THAT(asked_place(scene, o).note, testing::HasSubstr("behind the surface that pixel 32,24 shows"));
  const Vec3 before = scene.camera.unproject(32.5, 24.5, depth);
  o.at_point = {{before.x, before.y, before.z}};
  EXPECT_EQ(asked_place(scene, o).note, "");
  light(o);  // and a note does not keep it from being made
  fs::remove(o.out);

  o.at_point = {{0, 0, -3.1 * scene.scale()}};
  expect_refused(o, "out of the room");
  o.at_point = {{0, std::nan(""), -1}};
  expect_refused(o, "not a point");
  o.at = {{3, 3}};
  expect_refused(o, "one place");
  o.at_point.reset(), o.at.reset();
  expect_refused(o, "one place");
  o.at = {{64, 3}};
  expect_refused(o, "outside of the picture");
  o = options("other"), o.out = *folder_ / "other.png";
  expect_refused(o, "written as EXR");
}

TEST_F(Light, LampsAreFittedUnderLearnedLightAndWhereTheyAreAskedFor) {
  const auto written = [](const LightOptions& o) {
    light(o);
    return read_provenance(fs::path(o.out).replace_extension(".json"));
  };
  LightOptions with = options("with"), without = options("without"), image = options("image"), asked = options("asked");
  with.lit_by.lamps = image.lit_by.lamps = "auto", asked.lit_by.lamps = "fit";
  image.render.light = asked.render.light = "image";
  const Provenance lit = written(with);
  ASSERT_TRUE(lit.facts.contains("lamps"));
  EXPECT_THAT(lit.facts.at("lamps"), testing::HasSubstr("candidates"));
  EXPECT_GT(lit.figures.at("lamps"), 0) << "untrained nets leave the room dark";
  EXPECT_FALSE(written(without).facts.contains("lamps"));
  EXPECT_FALSE(written(image).facts.contains("lamps"));
  EXPECT_TRUE(written(asked).facts.contains("lamps")) << "the photograph may have lamps beside it, too";
  const Image a = read_map(with.out, 3), b = read_map(without.out, 3);
  double more = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    EXPECT_GE(a.data[i], b.data[i] * (1 - 0x1p-9f)) << "lamps add light";
    more += a.data[i] - b.data[i];
  }
  EXPECT_GT(more, 0);
  EXPECT_TRUE(read_provenance(run() / "provenance.json").facts.contains("lamps")) << "invert fits them, too";
}

TEST_F(Light, RunsAndWeightsThatDoNotDo) {
  LightOptions o = options("bad");
  o.run = *folder_ / "nowhere";
  expect_refused(o, "no such run folder");
  const fs::path part = *folder_ / "only";
  fs::copy(run(), part);
  fs::remove(part / "normal.exr");
  o.run = part;
  expect_refused(o, "normal");
  o = options("bad"), o.lit_by.weights = *folder_ / "rooms";  // a folder without the light's files
  expect_refused(o, "light_local.safetensors");
  o.lit_by.weights = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";  // weights without the light
  expect_refused(o, "maps");
  o = options("bad"), o.render.light = "sun";
  expect_refused(o, "no such light");
}

TEST_F(Light, CommandSaysWhatIsWrong) {
  const fs::path output = *folder_ / "output.txt";
  const auto said = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"light", run().string(), "--light", "image"});
    Program program(arguments, output);
    EXPECT_EQ(program.wait(), static_cast<int>(ErrorKind::Usage));
    return text_of(output);
  };
  EXPECT_THAT(said({"--at-point", "0,nan,-1"}), testing::HasSubstr("not a finite number"));
  EXPECT_THAT(said({"--at-point", "0,1"}), testing::HasSubstr("wrong number of values"));
  EXPECT_THAT(said({"--at-point", "0,0,-1", "--size", "0x5"}), testing::HasSubstr("size out of range"));
  EXPECT_THAT(said({}), testing::HasSubstr("one place"));
  const std::string out = (*folder_ / "twice.exr").string(), record = (*folder_ / "twice.json").string();
  EXPECT_THAT(said({"--at-point", "0,0,-1", "--out", out, "--json=" + record}), testing::HasSubstr("written twice"));
  EXPECT_FALSE(fs::exists(out));
  Program insert(
      {"insert", run().string(), "--at", "20,30", "--radius", "0.1", "--json=" + (run() / "composite.exr").string()},
      output);
  EXPECT_EQ(insert.wait(), static_cast<int>(ErrorKind::Usage));
  EXPECT_THAT(text_of(output), testing::HasSubstr("written twice"));
}

TEST_F(Light, IsTheDefaultWhereItsWeightsAreShipped) {
  Device device = Device::open();
  RenderSettings settings;
  settings.light = "net";
  ::setenv("CLERESTORY_LIGHT_WEIGHTS", weights().c_str(), 1);
  EXPECT_EQ(lights_to_choose().front(), "net");
  load_light_nets(settings, {}, device);
  ASSERT_TRUE(settings.nets);
  EXPECT_EQ(settings.nets->longer_side, 40);
  ::setenv("CLERESTORY_LIGHT_WEIGHTS", folder_->path().c_str(), 1);
  EXPECT_EQ(lights_to_choose().front(), "image");
  EXPECT_THROW(load_light_nets(settings, {}, device), Error);
  ::unsetenv("CLERESTORY_LIGHT_WEIGHTS");
}

TEST_F(Light, ThePapersWorkIsCounted) {
  // Products alone: 128 Fourier features into 512, eight layers of 512, three colours; the field's 11,140 parameters
  // less 196 biases, 64 times.
  InViewSize in_view = light_sizes("paper").in_view;
  in_view.again = 0;
  EXPECT_EQ(in_view_flops(in_view), 2.0 * (128 * 512 + 8 * 512 * 512 + 3 * 512));
  in_view.again = 5;  // the input's directions once more
  EXPECT_EQ(in_view_flops(in_view), 2.0 * (2 * 128 * 512 + 8 * 512 * 512 + 3 * 512));
  EXPECT_EQ(out_of_view_flops(light_sizes("paper").out_of_view), 2.0 * 64 * (11140 - 196));

  Device device = Device::open();
  const InvertWork all = invert_work(device, "paper", 320, 240, {}, {"net", light_sizes("paper"), 100});
  PredictRequest only_depth;
  only_depth.albedo = only_depth.normal = only_depth.material = false;
  const InvertWork depth = invert_work(device, "paper", 320, 240, only_depth, {"image", {}, 100});
  // DenseNet121 needs 2.9 GMAC for 224 x 224 (Huang et al. 2017, table 2, as counted by its implementations) at strides
  // up to 32; ours ends at stride 16, has a decoder more for each map, and looks at the photograph twice.
  EXPECT_GT(depth.maps, 2 * 2 * 2.8e9 * (320 * 240) / (224 * 224.0));
  EXPECT_GT(all.maps, depth.maps + 1e9);
  EXPECT_EQ(depth.all(), depth.maps);
  EXPECT_EQ(all.out_of_view, 100 * 2.0 * 64 * (11140 - 196));
  EXPECT_GT(all.encoders, 2 * 3.6e9 * (320 * 240) / (224 * 224.0));  // ResNet34: 3.6 GMAC (He et al. 2016, table 1)
  EXPECT_THAT(describe(all, 100), testing::HasSubstr("at the measured peak of 100 GFLOP/s"));
}

TEST_F(Light, InvertTellsItsPartsApart) {
  const fs::path painted = *folder_ / "painted", by = *folder_ / "weights of spheres";
  write_untrained_light(by, {40, 30}, OutOfViewForm::Shells);
  invert(taken_apart(painted, by));
  for (const fs::path& out : {run(), painted}) {
    const Provenance p = read_provenance(out / "provenance.json");
    EXPECT_THAT(p.facts.at("light"), testing::HasSubstr("net ("));
    double parts = 0;
    for (const char* part : {"light's networks", "SSRT", "in-view MLP", "out of view", "shading"}) {
      const double seconds = p.figures.at("seconds: re-render, " + std::string(part));
      EXPECT_GT(seconds, 0) << part;
      parts += seconds;
    }
    EXPECT_LT(parts, p.figures.at("seconds: re-render"));
    EXPECT_GT(p.figures.at("rays answered in view"), 0);
    EXPECT_GT(p.figures.at("rays answered out of view"), 0);
    EXPECT_LE(p.figures.at("rays answered out of view"), p.figures.at("rays"));
    EXPECT_THAT(read_file(out / "plan.txt"), testing::HasSubstr("light out of view: asked for"));
    EXPECT_THAT(read_file(out / "report.html"), testing::HasSubstr("in it: light out of view"));
  }
}

TEST_F(Light, NetsAreAskedWithTheUncertaintyThatTheyWereTrainedWith) {
  InvertOptions other = taken_apart(*folder_ / "window", weights());  // their metadata say nothing: linear
  other.render.delta = "window";
  try {
    invert(other);
    FAIL() << "the nets were fed an uncertainty that they do not know";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_THAT(std::string(e.what()), testing::AllOf(testing::HasSubstr("--delta"), testing::HasSubstr("linear")));
  }
  EXPECT_FALSE(fs::exists(other.out));
  other.render.light = "image";  // asks no net
  EXPECT_NO_THROW(invert(other));
  other.render.light = "out_of_view", other.out = *folder_ / "far";  // mixes nothing
  EXPECT_NO_THROW(invert(other));
  // Nets that were trained so are asked so, whether it is said or not.
  LightSizes sizes = light_sizes("compact");
  sizes.delta = DeltaDepth::Window;
  RenderSettings settings;
  settings.light = "net", settings.nets = std::make_shared<LightNets>(LightNets{sizes, 40, nullptr, "these"});
  EXPECT_EQ(render_spec(settings).ssrt.delta, DeltaDepth::Window);
  settings.delta = "window";
  EXPECT_EQ(render_spec(settings).ssrt.delta, DeltaDepth::Window);
  settings.delta = "linear";
  EXPECT_THROW(render_spec(settings), Error);
}

TEST_F(Light, TheWidestNetsThatTrainCanBeAsked) {
  const Device device = Device::open();
  const TrainingOptions options = training_options(Config(
      training_schema(), {"train.steps=1", "model.kind=light", "light.out_of_view=field", "light.width=512",
                          "light.layers=1", "light.frequencies=102", "light.field=[64,64,64,64]", "light.segments=4"}));
  const auto nets =
      std::make_shared<LightNets>(LightNets{options.model.light, 40, std::make_shared<States>(device), "wide"});
  Graph graph;
  for (const auto& [name, shape] : light_states(options.model.light)) graph.state(name, shape, Init::constant(0.001));
  nets->states->initialise(graph, 1);
  RenderSettings settings;
  settings.light = "net", settings.nets = nets, settings.spp = 2;
  Device asking = device;
  const Scene scene = read_run(run());
  EXPECT_GT(render_scene(asking, scene, settings).answered.size(), 1u);
}

TEST_F(Light, AnObjectIsLitByItAtEveryBounce) {
  Device device = Device::open();
  const Scene scene = read_run(run());
  RenderSettings settings;
  settings.light = "net", settings.spp = 16;
  load_light_nets(settings, weights(), device);
  const double depth = 0.5 * scene.depth.at(0, 24, 32);
  const Vec3 c = scene.camera.unproject(32.5, 24.5, depth);
  InsertedObject ball;
  ball.at_point = {c.x, c.y, c.z}, ball.radius = 0.15 * depth, ball.roughness = 0.02;
  const Insertion net = insert_into(device, scene, {ball}, settings, 2);
  const Insertion again = insert_into(device, scene, {ball}, settings, 2);
  EXPECT_EQ(net.composite.data, again.composite.data);
  settings.light = "image";
  const Insertion image = insert_into(device, scene, {ball}, settings, 2);
  const std::size_t n = scene.photo.pixels();
  int seen = 0, other = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 3; ++k) ASSERT_TRUE(std::isfinite(net.composite.data[k * n + i]));
    if (net.covers.data[i] == 0) continue;
    ++seen;
    other += net.composite.data[i] != image.composite.data[i];
  }
  EXPECT_GT(seen, 20);
  EXPECT_GT(other, seen / 2);  // a mirror ball shows mostly what lies out of view

  ball.radius = 100;  // larger than the room, whatever the light
  settings.light = "net";
  EXPECT_THROW(insert_into(device, scene, {ball}, settings, 2), Error);
}

/// Rays that change nothing have no direction, and rays of a bounce that ended have none either.
TEST_F(Light, NoSampleIsLostToObjects) {
  Device device = Device::open();
  const Scene scene = read_run(run());
  InsertedObject ball;
  ball.at = {32, 40}, ball.radius = 0.2 * scene.scale(), ball.roughness = 0.8;  // many directions below its horizon
  for (const OutOfViewForm form : {OutOfViewForm::Field, OutOfViewForm::Shells}) {
    const ScratchFolder folder("clerestory-light-objects");
    write_untrained_light(folder.path(), {40, 30}, form);
    for (const char* light : {"net", "out_of_view"})
      for (const Sharing sharing : {Sharing::Never, Sharing::Always}) {
        RenderSettings settings;
        settings.light = light, settings.sharing = sharing, settings.spp = 8;
        load_light_nets(settings, folder.path(), device);
        EXPECT_EQ(insert_into(device, scene, {ball}, settings, 2).dropped, 0)
            << light << ", form " << static_cast<int>(form) << ", shared " << (sharing == Sharing::Always);
      }
  }
}

/// Who multiplies reaches the small nets too, and changes roundings alone.
TEST_F(Light, IsTheSameByClblast) {
  Device device = Device::open();
  const Scene scene = read_run(run());
  RenderSettings settings;
  settings.light = "net", settings.spp = 16;
  load_light_nets(settings, weights(), device);
  InsertedObject ball;
  const Vec3 c = scene.camera.unproject(32.5, 24.5, 0.5 * scene.depth.at(0, 24, 32));
  ball.at_point = {c.x, c.y, c.z}, ball.radius = 0.08 * scene.depth.at(0, 24, 32), ball.roughness = 0.02;
  std::map<std::string, std::string> kernels;
  const auto inserted = [&](const std::string& gemm) {
    device.use_gemm(gemm), device.set_profiling(true), device.reset_profile();
    const Insertion with = insert_into(device, scene, {ball}, settings, 2);
    for (const KernelProfile& k : device.profile()) kernels[gemm] += k.kernel + " ";
    device.set_profiling(false);
    return with.composite;
  };
  const Image own = inserted("packed"), blas = inserted("clblast");
  for (const char* kernel : {"ask_mlp", "ask_field", "conv_cpu"}) {
    EXPECT_THAT(kernels["packed"], testing::HasSubstr(kernel));
    EXPECT_THAT(kernels["clblast"], testing::Not(testing::HasSubstr(kernel)));
  }
  EXPECT_THAT(kernels["clblast"], testing::HasSubstr("begin_layer"));
  const double largest = *std::ranges::max_element(own.data);
  // Some 100 products deep, thrice that with the samples' sum.
  for (std::size_t i = 0; i < own.data.size(); ++i)
    ASSERT_NEAR(own.data[i], blas.data[i], 300 * 0x1p-24 * largest) << i;

  InvertOptions again = taken_apart(*folder_ / "by_clblast", weights());
  again.gemm = "clblast";
  invert(again);
  const Image before = read_map(run() / "rerender.exr", 3), after = read_map(again.out / "rerender.exr", 3);
  // A picture is stored in half precision.
  for (std::size_t i = 0; i < before.data.size(); ++i)
    ASSERT_NEAR(before.data[i], after.data[i], 0x1p-9 * before.data[i] + 300 * 0x1p-24 * largest) << i;
}

TEST_F(Light, AnEditIsLitByItAndLeavesTheRest) {
  Device device = Device::open();
  const Scene scene = read_run(run());
  RenderSettings settings;
  settings.light = "net", settings.spp = 16;
  load_light_nets(settings, weights(), device);
  Image mask(64, 48, 1);
  for (int y = 36; y < 48; ++y)
    for (int x = 10; x < 50; ++x) mask.at(0, y, x) = 1;
  const MaterialEdit mirror{.albedo = {{0.9, 0.9, 0.9}}, .roughness = 0.02, .metallic = 1};
  const Edit net = edit_scene(device, scene, mask, mirror, settings, 1);
  settings.light = "image";
  const Edit image = edit_scene(device, scene, mask, mirror, settings, 1);
  const std::size_t n = scene.photo.pixels();
  int differ = 0;
  for (std::size_t i = 0; i < 3 * n; ++i) {
    if (mask.data[i % n] > 0)
      differ += net.composite.data[i] != image.composite.data[i];
    else
      ASSERT_EQ(net.composite.data[i], scene.photo.data[i]) << i;
  }
  EXPECT_GT(differ, 100);

  settings.light = "net";
  EXPECT_THROW(edit_scene(device, scene, Image(64, 48, 1), mirror, settings, 1), Error);     // empty
  EXPECT_THROW(edit_scene(device, scene, Image(32, 48, 1, 1), mirror, settings, 1), Error);  // another size
}

}  // namespace
}  // namespace clerestory
