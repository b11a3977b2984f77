// The schema, the shipped configs, schedules and limits of a leg, and the history that weights carry.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "experiments/training/options.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/weights/history.hpp"
#include "experiments/weights/maps_text.hpp"
#include "host/error.hpp"
#include "tests/cl/environment.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

TEST(TrainingOptions, ShippedConfigsResolve) {
  const std::string folder = CLERESTORY_SOURCE_DIR "/experiments/configs/";
  const TrainingOptions compact = training_options(load_config(folder + "mgnet_compact.toml", training_schema()));
  EXPECT_EQ(compact.model.preset, "compact");
  EXPECT_EQ(compact.model.size, (Size{160, 120}));
  EXPECT_EQ(compact.train.minutes, 100);
  EXPECT_EQ(compact.loss.weights.perceptual, 0);  // no ImageNet weights are given
  const TrainingOptions paper = training_options(load_config(folder + "mgnet_paper.toml", training_schema()));
  EXPECT_EQ(paper.train.batch, 64);
  EXPECT_EQ(paper.train.epochs, 20);
  EXPECT_EQ(paper.train.rate.kind, LearningRate::Kind::Step);
  EXPECT_FALSE(paper.data.augmentation.flip);
  const TrainingOptions tuned = training_options(load_config(folder + "finetune.toml", training_schema()));
  EXPECT_FALSE(tuned.data.finetune.on()) << "its folders are for who has them to name";
  EXPECT_EQ(tuned.data.finetune.share, 0.5);
  EXPECT_EQ(tuned.loss.weights.judgements, 0);
  // the base sets no limit: it is no run by itself
  EXPECT_THROW(training_options(load_config(folder + "mgnet.toml", training_schema())), Error);
}

TEST(TrainingOptions, ValuesThatDoNotGoTogetherNameTheirKey) {
  try {
    training_options(Config(training_schema(), {"train.steps=1", "data.exposure=[0.9,0.8]"}));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(e.what()).find("data.exposure"), std::string::npos) << e.what();
  }
  EXPECT_THROW(Config(training_schema(), {"train.lr=1"}), Error);
}

TEST(TrainingOptions, LightsThatTrainButCannotBeAskedAreRefused) {
  const auto refused = [](const std::vector<std::string>& words, const std::string& key) {
    std::vector<std::string> all{"train.steps=1", "model.kind=light"};
    all.insert(all.end(), words.begin(), words.end());
    try {
      training_options(Config(training_schema(), all));
      ADD_FAILURE() << words.back() << " was accepted";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
    }
  };
  refused({"light.width=40"}, "light.width");
  refused({"light.width=528"}, "light.width");
  refused({"light.frequencies=257"}, "light.frequencies");
  refused({"light.frequencies=103"}, "light.frequencies");
  refused({"light.net=li2020", "loss.irradiance=1"}, "loss.irradiance");
  refused({"light.net=li2020", "loss.unseen=1"}, "loss.unseen");
  refused({"light.net=li2020", "model.input=imagenet"}, "model.input");
  refused({"light.out_of_view=field", "light.field=[65]"}, "light.field");
  refused({"light.out_of_view=field", "light.field=[8,8,8,8,8]"}, "light.field");
  for (const char* preset : {"compact", "paper"})  // what stays is asked below, in light_test.cpp
    EXPECT_NO_THROW(training_options(
        Config(training_schema(), {"train.steps=1", "model.kind=light", std::string("model.preset=") + preset,
                                   "light.width=512", "light.frequencies=102", "light.field=[64,64,64,64]"})));
}

TEST(TrainingOptions, NetsSurviveTheirText) {
  for (const char* preset : {"compact", "paper", "shared", "lite"}) {
    const std::string text = net_text(mgnet_size(preset));
    EXPECT_EQ(net_text(net_from_text(text, "test")), text);
    EXPECT_EQ(net_from_text(text, "test").shared(), mgnet_size(preset).shared());
    for (const char* more : {"-8", "-", " "}) EXPECT_THROW(net_from_text(text + more, "test"), Error) << text << more;
  }
  const std::string encoder = "growth 4, 16 first channels, layers 1-1-1-1, ";
  EXPECT_NO_THROW(net_from_text(encoder + "shared decoder 8-8-16-8-8-24", "test"));
  for (const char* decoder :
       {"", "decoder 32-16-16-8", "decoder 32-16-16-8-5", "shared decoder 8-8-8-8-8", "shared decoder 8-8-8-8-8-4",
        "shared decoder 8-8-8-8-8-0", "shared decoder 8-8-8-8-8--8", "shared 8-8-8-8-8-8", "decoder 8-8-8-8-8-8"})
    EXPECT_THROW(net_from_text(encoder + decoder, "test"), Error) << decoder;
}

TEST(TrainingOptions, SharedDecodersHaveSixStepsAndAreForMaps) {
  const auto options = [](std::vector<std::string> more) {
    more.insert(more.end(), {"train.steps=1", "model.preset=shared"});
    return training_options(Config(training_schema(), more));
  };
  EXPECT_EQ(options({"model.decoder=[8,16,8,8,8,24]"}).model.net.steps()[5], 24);
  EXPECT_TRUE(options({}).model.net.shared());
  const auto message = [&](const std::string& more) { return message_of<Error>([&] { options({more}); }); };
  EXPECT_THAT(message("model.decoder=[8,8,8,8,8]"), testing::HasSubstr("model.decoder"));
  EXPECT_THAT(message("model.decoder=[8,8,8,8,8,12]"), testing::HasSubstr("multiples of 8"));
  EXPECT_THAT(message("model.kind=light"), testing::HasSubstr("model.preset"));
  EXPECT_THAT(message("model.kind=light"), testing::HasSubstr("paper or compact"));
}

TEST(TrainingOptions, LiteHasSizesOfItsOwn) {
  const auto options = [](std::vector<std::string> more) {
    more.insert(more.end(), {"train.steps=1"});
    return training_options(Config(training_schema(), more));
  };
  const std::string lite = "model.preset=lite", channels = "model.channels=[8,8,16,16,16,24,32]";
  const MgnetSize net = options({lite, channels, "model.layers=[1,1,1,1,1,1,2]"}).model.net;
  EXPECT_EQ(std::get<EfficientnetSize>(net.encoder).channels[6], 32);
  EXPECT_EQ(std::get<EfficientnetSize>(net.encoder).layers[6], 2);
  EXPECT_EQ(net_text(net_from_text(net_text(net), "test")), net_text(net));
  const auto message = [&](std::vector<std::string> more) { return message_of<Error>([&] { options(more); }); };
  EXPECT_THAT(message({lite, "model.growth=16"}), testing::HasSubstr("model.growth"));
  EXPECT_THAT(message({lite, "model.layers=[1,1,1,1]"}), testing::HasSubstr("model.layers"));
  EXPECT_THAT(message({channels}), testing::HasSubstr("model.channels"));
  EXPECT_THAT(message({lite, "model.kind=light"}), testing::HasSubstr("paper or compact"));
  for (const char* text : {"channels 8-8-16-16-16-24, layers 1-1-1-1-1-1-2, shared decoder 8-8-8-8-8-8",
                           "channels 8-8-16-16-16-24-0, layers 1-1-1-1-1-1-2, shared decoder 8-8-8-8-8-8",
                           "channels 8-8-16-16-16-24-32, layers 1-1-1-1, shared decoder 8-8-8-8-8-8",
                           "channels 8-8-16-16-16-24-32, shared decoder 8-8-8-8-8-8"})
    EXPECT_THROW(net_from_text(text, "test"), Error) << text;
}

TEST(TrainingOptions, WhereARunGoesDoesNotRenameIt) {
  const Config plain(training_schema(), {"train.steps=1"});
  EXPECT_EQ(config_hash(plain), config_hash(plain.with({"run.root=/elsewhere", "log.every=7", "run.seed=3"})));
  EXPECT_NE(config_hash(plain), config_hash(plain.with({"train.rate=1e-3"})));
}

TEST(LearningRateTest, FallsAsItsScheduleSays) {
  LearningRate rate;
  rate.initial = 1, rate.kind = LearningRate::Kind::Step;
  EXPECT_DOUBLE_EQ(rate.at(9, 0), 1);
  EXPECT_DOUBLE_EQ(rate.at(9, 0.2499), 1);
  EXPECT_DOUBLE_EQ(rate.at(9, 0.25), 0.5);
  EXPECT_DOUBLE_EQ(rate.at(9, 0.99), 0.125);
  EXPECT_DOUBLE_EQ(rate.at(9, 1), 0.125);
  rate.kind = LearningRate::Kind::Cosine;
  EXPECT_DOUBLE_EQ(rate.at(9, 0), 1);
  EXPECT_DOUBLE_EQ(rate.at(9, 0.5), 0.02 + 0.98 / 2);
  EXPECT_DOUBLE_EQ(rate.at(9, 1), 0.02);
  rate.kind = LearningRate::Kind::Constant, rate.warmup = 4;
  EXPECT_DOUBLE_EQ(rate.at(0, 0), 0.25);
  EXPECT_DOUBLE_EQ(rate.at(3, 0), 1);
  EXPECT_DOUBLE_EQ(rate.at(400, 1), 1);
}

TEST(LegLimitsTest, FirstLimitCounts) {
  EXPECT_DOUBLE_EQ((LegLimits{100, 0}.fraction(25, 1e9)), 0.25);
  EXPECT_DOUBLE_EQ((LegLimits{0, 10}.fraction(25, 5)), 0.5);
  EXPECT_DOUBLE_EQ((LegLimits{100, 10}.fraction(80, 5)), 0.8);
  EXPECT_DOUBLE_EQ((LegLimits{100, 10}.fraction(800, 5)), 1);
}

History history() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Leg leg;
  leg.experiment = "e", leg.variant = "v", leg.commit = "abc", leg.preset = "compact", leg.init = "old.safetensors";
  leg.width = 160, leg.height = 120, leg.batch = 8, leg.seed = 7, leg.rooms = 3, leg.views = 30, leg.steps = 100,
  leg.views_seen = 800;
  leg.hours = 1.5, leg.overrides = {"train.rate=0.001"};
  leg.curve = {{0, 0.1, 1.5, {30, 0.4, 0.02, 0.04, nan}, {1.5, 1.2, 1, 1, nan}, 0.7},
               {100, 1.5, 0.8, {20, 0.3, 0.01, 0.03, nan}, {0.7, 0.8, 0.9, 1, nan}, 0.25}};
  History h;
  h.legs = {leg, leg};
  return h;
}

TEST(HistoryTest, SurvivesItsText) {
  History h = history();
  HistoryPoint& diverged = h.legs[0].curve[0];
  diverged.score = diverged.scale_error = std::numeric_limits<double>::quiet_NaN();
  const std::string text = history_json(h);
  const History back = history_from_json(text, "test");
  EXPECT_EQ(history_json(back), text);
  EXPECT_DOUBLE_EQ(back.hours(), 3);
  EXPECT_EQ(back.views_seen(), 1600);
  EXPECT_TRUE(std::isnan(back.legs[0].curve[0].errors[4]) && std::isnan(back.legs[0].curve[0].score));
  EXPECT_THROW(history_from_json("{", "test"), Error);
  EXPECT_THROW(history_from_json(R"([{"experiment":"e"}])", "test"), Error);
}

TEST(HistoryTest, ListsAndFramesTravelAndStandInTheCard) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  History h = history();
  HistoryPoint& last = h.legs.back().curve.back();
  last.lists = {{"held_out", 200, 0.81, {21, 0.35, 0.02, 0.06, nan}, {0.6, 0.7, 0.8, 0.9, nan}, 0.1}};
  last.frames = {{"office", 0.3, 0.4, 1.25}, {"desk", 0.2, 0.1, 0.5}};
  const std::string text = history_json(h);
  EXPECT_EQ(history_json(history_from_json(text, "test")), text);
  const std::string card = model_card(h, {}, {"validation.svg", "lists.svg"});
  for (const char* expected :
       {"held_out (200 views)", "| normals, degrees | 21 (0.60) |", "| office | 0.3 | 0.75 | 1.25 |", "(lists.svg)"})
    EXPECT_NE(card.find(expected), std::string::npos) << expected << "\n" << card;
  const Plot plot = lists_plot(h);
  ASSERT_EQ(plot.series.size(), 3u);  // the list, photographs, and the validation beside them
  EXPECT_EQ(plot.series[0].label, "held_out");
  EXPECT_EQ(plot.series[0].y, (std::vector<double>{0.81}));
  EXPECT_DOUBLE_EQ(plot.series[1].y.at(0), std::sqrt(0.75 * 2));
  EXPECT_TRUE(lists_plot(history()).series.empty());
  EXPECT_EQ(model_card(history(), {}, {}).find("Fixed lists"), std::string::npos);
}

TEST(HistoryTest, CardStatesTheFigures) {
  const std::string card = model_card(history(), {{"file", "weights.safetensors"}}, {"validation.svg", "lists.svg"});
  for (const char* expected :
       {"| normals | 20 degrees | 0.7 |", "| metallic | - MSE | - |", "3.00 hours, 1600 views seen, 2 legs",
        "validation.svg", "old.safetensors", "a factor of 1.28", "`train.rate=0.001`"})
    EXPECT_NE(card.find(expected), std::string::npos) << expected << "\n" << card;
  const Plot plot = history_plot(history());
  EXPECT_EQ(plot.series.size(), 5u);  // the mean and four maps; no view has metallic
  EXPECT_EQ(plot.series[0].y.size(), 4u);
}

}  // namespace
}  // namespace clerestory
