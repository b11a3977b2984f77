// Trainings of maps with a perceptual term: where its features come from, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "experiments/training/network.hpp"
#include "experiments/training/training_views.hpp"
#include "experiments/weights/maps_text.hpp"
#include "host/error.hpp"
#include "host/io/safetensors.hpp"
#include "tests/experiments/training_run.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

const std::string kShippedMaps = std::string(CLERESTORY_SOURCE_DIR) + "/nets/weights/maps.safetensors";

struct PerceptualRun : TrainingRun {
  /// States of the net that such a training begins with.
  std::shared_ptr<States> states_of(std::vector<std::string> more) const {
    more.push_back("train.steps=1");
    const auto states = std::make_shared<States>(Device::open());
    TrainingNetwork(Device::open(), training_options(config("runs", more)), states);
    return states;
  }
  std::string refused(const std::vector<std::string>& more) const {
    return message_of([&] { states_of(more); }, ErrorKind::Usage);
  }
};

TEST_F(PerceptualRun, RandomFeaturesAreThoseOfTheSeedWhateverElseIsTrained) {
  const std::string random = "loss.perceptual_features=random", name = "vgg.features.10.weight";
  const std::vector<float> one = states_of({random, "run.seed=1"})->get(name).floats();
  EXPECT_EQ(states_of({random, "run.seed=1", "loss.albedo=3", "model.growth=8"})->get(name).floats(), one);
  EXPECT_NE(states_of({random, "run.seed=2"})->get(name).floats(), one);
  double squares = 0;
  for (const float w : one) squares += static_cast<double>(w) * static_cast<double>(w);
  // He et al.: 2 / fan_in = 2 / (128 * 9). Of n normal numbers the mean square is off by sqrt(2 / n), five times here.
  const double n = static_cast<double>(one.size()), wanted = 2.0 / (128 * 9);
  EXPECT_NEAR(squares / n, wanted, 5 * std::sqrt(2 / n) * wanted);
}

TEST_F(PerceptualRun, FeaturesOfRoomsAreTheEncoderOfTheFile) {
  const auto states =
      states_of({"loss.perceptual_features=rooms", "loss.perceptual_weights=" + kShippedMaps, "model.encoder=random"});
  int encoder = 0;
  for (const auto& [name, tensor] : read_safetensors(kShippedMaps).tensors) {
    if (!name.starts_with("encoder.")) continue;
    ++encoder;
    ASSERT_TRUE(states->has("rooms." + name)) << name;
    EXPECT_EQ(states->get("rooms." + name).floats(), tensor.floats()) << name;
  }
  EXPECT_GT(encoder, 10);
}

TEST_F(PerceptualRun, FeaturesStayAsTheyAreAndAreNotKept) {
  for (const std::vector<std::string>& features :
       {std::vector<std::string>{"loss.perceptual_features=random"},
        std::vector<std::string>{"loss.perceptual_features=rooms", "loss.perceptual_weights=" + kShippedMaps}}) {
    std::vector<std::string> more = features;
    more.insert(more.end(), {"train.steps=1", "loss.perceptual=1"});
    const TrainingOutcome outcome = run(features[0], more);
    for (const auto& entry : fs::directory_iterator(outcome.folder / "checkpoints"))
      for (const auto& [name, tensor] : read_safetensors(entry.path()).tensors)
        EXPECT_FALSE(is_frozen_feature(name)) << name;
    EXPECT_THAT(text_of(outcome.folder / "log.txt"), HasSubstr("the perceptual term looks through"));

    TrainingOptions options = training_options(config("again", more));
    const auto states = std::make_shared<States>(Device::open());
    TrainingNetwork network(Device::open(), options, states);
    std::map<std::string, std::vector<float>> before;
    for (const std::string& name : states->names()) before[name] = states->get(name).floats();
    ViewStore store(name_views(options.data.train_roots, options.data.train_split), 32, 32, 0);
    const auto views = fixed_views(store, 1);
    BatchStream stream(*views, options.data.augmentation, 1, 0, options.train.batch, 0);
    network.step(stream.next(), 1e-3);
    int frozen = 0, moved = 0;
    for (const auto& [name, values] : before) {
      const bool same = states->get(name).floats() == values;
      if (is_frozen_feature(name)) {
        EXPECT_TRUE(same) << name;
        ++frozen;
      } else {
        moved += !same;
      }
    }
    EXPECT_GT(frozen, 10);
    EXPECT_GT(moved, 10);
  }
}

// Features are in no checkpoint: who goes on draws the same again.
TEST_F(PerceptualRun, GoesOnInTheSameBits) {
  const std::vector<std::string> settings{"train.steps=4", "log.validate_every=0", "log.checkpoint_every=2",
                                          "loss.perceptual=1", "loss.perceptual_features=random"};
  const auto last_of = [](const TrainingOutcome& outcome) {
    auto tensors = read_safetensors(outcome.folder / "checkpoints/step-00000004.safetensors").tensors;
    tensors.erase("training.progress");  // holds the time it took
    return tensors;
  };
  const TrainingOutcome whole = run("runs", settings);
  const auto unbroken = last_of(whole);
  fs::remove(whole.folder / "DONE"), fs::remove(whole.folder / "checkpoints/step-00000004.safetensors");
  const TrainingOutcome resumed = run("runs", settings);
  EXPECT_THAT(text_of(resumed.folder / "log.txt"), HasSubstr("goes on after step 2 "));
  const auto found = last_of(resumed);
  ASSERT_EQ(found.size(), unbroken.size());
  for (const auto& [name, tensor] : unbroken) EXPECT_EQ(found.at(name).values, tensor.values) << name;
}

// Nor is what they were read from: other weights of that name are refused.
TEST_F(PerceptualRun, OtherFeaturesThanItBeganWithAreRefused) {
  const fs::path features = folder / "features.safetensors";
  fs::copy_file(kShippedMaps, features);
  const std::vector<std::string> settings{
      "train.steps=2",     "log.validate_every=0",           "log.checkpoint_every=1",
      "loss.perceptual=1", "loss.perceptual_features=rooms", "loss.perceptual_weights=" + features.string()};
  const TrainingOutcome whole = run("runs", settings);
  const auto refusal = [&] { return message_of([&] { run("runs", settings); }, ErrorKind::Usage); };
  fs::copy_file(run("other", {"train.steps=1"}).weights, features, fs::copy_options::overwrite_existing);
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("began with other weights"), HasSubstr(features.string())));
  fs::remove(whole.folder / "DONE"), fs::remove(whole.folder / "checkpoints/step-00000002.safetensors");
  EXPECT_THAT(refusal(), HasSubstr("began with other weights"));
}

TEST_F(PerceptualRun, WithoutFeaturesThereIsNoSuchTerm) {
  const auto weight = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{"train.steps=1"};
    all.insert(all.end(), more.begin(), more.end());
    return training_options(config("runs", all)).loss.weights.perceptual;
  };
  EXPECT_EQ(weight({}), 0);
  EXPECT_EQ(weight({"loss.perceptual=0.5"}), 0);
  EXPECT_EQ(weight({"loss.perceptual=0.5", "loss.perceptual_features=random"}), 0.5);
  EXPECT_EQ(weight({"loss.perceptual=0.5", "loss.perceptual_weights=vgg.safetensors"}), 0.5) << "as before the key";
}

TEST_F(PerceptualRun, FeaturesThatDoNotDoAreRefusedByName) {
  EXPECT_THAT(
      refused({"loss.perceptual_features=rooms"}),
      AllOf(HasSubstr("loss.perceptual_features"), HasSubstr("found rooms"), HasSubstr("loss.perceptual_weights")));
  EXPECT_THAT(refused({"loss.perceptual_features=imported"}),
              AllOf(HasSubstr("loss.perceptual_features"), HasSubstr("found imported")));
  EXPECT_THAT(refused({"loss.perceptual_features=random", "loss.perceptual_weights=vgg.safetensors"}),
              AllOf(HasSubstr("loss.perceptual_weights"), HasSubstr("vgg.safetensors"), HasSubstr("random")));
  EXPECT_THAT(refused({"loss.perceptual_features=random", "loss.terms=li2020"}),
              AllOf(HasSubstr("loss.perceptual_features"), HasSubstr("li2020")));
  EXPECT_THAT(refused({"loss.perceptual_features=vgg19"}), HasSubstr("loss.perceptual_features"));

  const auto of_file = [&](const std::string& from, const fs::path& file) {
    return refused({"loss.perceptual_features=" + from, "loss.perceptual_weights=" + file.string()});
  };
  const fs::path light = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/light_local.safetensors";
  EXPECT_THAT(of_file("rooms", light), AllOf(HasSubstr("light_local.safetensors"), HasSubstr("light")));
  EXPECT_THAT(of_file("rooms", folder / "nowhere.safetensors"), HasSubstr("nowhere.safetensors"));
  EXPECT_THAT(of_file("imported", kShippedMaps), AllOf(HasSubstr("maps.safetensors"), HasSubstr("weights import")));
  TensorFile theirs = read_safetensors(kShippedMaps);
  theirs.metadata["net"] = net_text(mgnet_size("li2020"));
  write_safetensors(folder / "theirs.safetensors", theirs);
  EXPECT_THAT(of_file("rooms", folder / "theirs.safetensors"),
              AllOf(HasSubstr("loss.perceptual_weights"), HasSubstr("theirs.safetensors"), HasSubstr("MGNet")));
  TensorFile other = read_safetensors(kShippedMaps);
  other.tensors.erase("encoder.stem.weight");
  write_safetensors(folder / "other.safetensors", other);
  EXPECT_THAT(of_file("rooms", folder / "other.safetensors"), HasSubstr("encoder.stem.weight"));
}

}  // namespace
}  // namespace clerestory
