// The rival's nets trained by `clerestory train`: their maps and their light, on a generated room, and what the weights
// then are to those who load them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/applications/light_choice.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/message_of.hpp"
#include "tracer/generate.hpp"

namespace clerestory {
namespace {

constexpr int kSide = 64;  // the least that their light's net can halve

struct Li2020Training : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    folder_ = std::make_unique<ScratchFolder>("clerestory-li2020-training");
    for (const char* split : {"train", "val"}) {
      GenerateOptions o;
      o.out = *folder_ / split, o.rooms.count = 1, o.views.count = 2, o.views.width = kSide, o.views.height = kSide,
      o.views.spp = 2;
      o.light.spp = 1, o.light.probes = 1, o.rooms.seed = 5, o.rooms.split = split, o.rooms.boxes = true;
      generate(Device::open(), o);
    }
  }
  static void TearDownTestSuite() { folder_.reset(), set_quiet(false); }

  static TrainingOutcome trained(std::vector<std::string> more) {
    std::vector<std::string> all{fmt::format("model.width={}", kSide),
                                 fmt::format("model.height={}", kSide),
                                 "data.train=[" + (*folder_ / "train").string() + "]",
                                 "data.validation=[" + (*folder_ / "val").string() + "]",
                                 "run.root=" + (*folder_ / "runs").string(),
                                 "train.batch=2",
                                 "train.steps=24",
                                 "train.rate=2e-3",
                                 "train.schedule=constant",
                                 "data.flip=false",
                                 "data.exposure=[0.9,0.9]",
                                 "log.every=1",
                                 "log.validate_every=0",
                                 "log.checkpoint_every=0"};
    all.insert(all.end(), more.begin(), more.end());
    write_file(*folder_ / "li2020.toml", "");
    return train(load_config(*folder_ / "li2020.toml", training_schema(), all), {"clerestory", "train"});
  }

  /// The mean of the last four steps over that of the first four.
  static double fallen(const TrainingOutcome& outcome, const std::string& loss) {
    const Curve curve = curve_of(read_metrics(outcome.folder / "metrics.jsonl"), loss);
    double first = 0, last = 0;
    for (std::size_t i = 0; i < 4; ++i)
      first += curve.values.at(i), last += curve.values.at(curve.values.size() - 1 - i);
    return last / first;
  }
  static inline std::unique_ptr<ScratchFolder> folder_;
};

TEST_F(Li2020Training, MapsLearn) {
  const TrainingOutcome outcome = trained({"model.preset=li2020", "model.channels=[16,16,32,32,32,32]",
                                           "model.decoder=[32,32,32,16,16,16]", "loss.terms=li2020"});
  EXPECT_LT(fallen(outcome, "train/loss"), 0.8);
  const LoadedWeights weights = load_weights(outcome.weights, Device::open());
  ASSERT_TRUE(weights.net.li2020());
  EXPECT_EQ(std::get<Li2020MapsSize>(weights.net.encoder).encoder, (std::array<int, 6>{16, 16, 32, 32, 32, 32}));
}

TEST_F(Li2020Training, LightTrainsAndIsAskedByItsName) {
  const TrainingOutcome outcome = trained({"model.kind=light", "light.net=li2020", "light.rows=32", "light.samples=32",
                                           "loss.rerender=1", "light.clipped=0", "train.rate=3e-4", "train.steps=8"});
  // That both terms fall where light is simple: tests/nets/li2020_light_test.cpp. Of a room they do not in so few
  // steps.
  EXPECT_TRUE(std::isfinite(fallen(outcome, "train/mixed")));
  EXPECT_TRUE(std::isfinite(fallen(outcome, "train/rerender")));
  RenderSettings settings;
  settings.light = "li2020";
  load_light_nets(settings, outcome.weights, Device::open());
  EXPECT_TRUE(settings.nets->sizes.li2020);
  EXPECT_EQ(settings.nets->longer_side, kSide);
  settings.light = "net";
  EXPECT_THAT(message_of([&] { load_light_nets(settings, outcome.weights, Device::open()); }, ErrorKind::Usage),
              testing::HasSubstr("--light li2020"));
}

TEST(Li2020Text, NetsSurviveTheirText) {
  for (const char* preset : {"li2020", "li2020_paper"}) {
    const std::string text = net_text(mgnet_size(preset));
    EXPECT_EQ(net_text(net_from_text(text, "test")), text);
    EXPECT_TRUE(net_from_text(text, "test").li2020());
    for (const char* more : {"-16", "-", " "}) EXPECT_THROW(net_from_text(text + more, "test"), Error) << text << more;
  }
  const std::string encoder = "li2020 16-16-16-16-16-16, ", decoder = "decoder 16-16-16-16-16-16";
  EXPECT_NO_THROW(net_from_text(encoder + decoder, "test"));
  for (const std::string& wrong : {encoder, encoder + "decoder 16-16-16-16-16", encoder + "decoder 16-16-16-16-16-8",
                                   encoder + "shared " + decoder, "li2020 16-16-16-16-16, " + decoder,
                                   "li2020 16-16-16-16-16-24, " + decoder, "li2020, " + decoder})
    EXPECT_THROW(net_from_text(wrong, "test"), Error) << wrong;
}

TEST(Li2020Text, LightSurvivesItsText) {
  LightSizes sizes = light_sizes("compact");
  sizes.li2020 = Li2020LightSize{{16, 32}, {48, 16, 32, 16, 32, 64}, {16, 32, 48, 16, 16, 32}, 7};
  sizes.delta = DeltaDepth::Window;
  const std::string text = light_text(sizes);
  const LightSizes back = light_from_text(text, "test");
  EXPECT_EQ(light_text(back), text);
  ASSERT_TRUE(back.li2020);
  EXPECT_EQ(back.li2020->entry, sizes.li2020->entry);
  EXPECT_EQ(back.li2020->encoder, sizes.li2020->encoder);
  EXPECT_EQ(back.li2020->decoder, sizes.li2020->decoder);
  EXPECT_EQ(back.li2020->lobes, 7);
  EXPECT_EQ(back.delta, DeltaDepth::Window);
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    other.replace(other.find(from), from.size(), to);
    EXPECT_THROW(light_from_text(other, "test"), Error) << other;
  };
  refused("entry=16-32", "entry=16"), refused("entry=16-32", "entry=16-40"), refused("lobes=7", "lobes=0");
  refused("lobes=7", "lobes=7 in_view.width=16");
}

}  // namespace
}  // namespace clerestory
