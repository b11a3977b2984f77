// What training and evaluation refuse, and that they name it: settings and weights.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/training/evaluate.hpp"
#include "experiments/training/trainer.hpp"
#include "host/error.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/training_run.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST_F(TrainingRun, ListsAndStreamsThatDoNotDoAreRefusedByName) {
  const auto message = [&](std::vector<std::string> more) {
    more.push_back("train.steps=2");
    try {
      run("refused", more);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Usage);
      return std::string(e.what());
    }
    ADD_FAILURE() << "accepted";
    return std::string();
  };
  EXPECT_THAT(message({"data.lists=[here]"}), HasSubstr("NAME=FOLDER"));
  EXPECT_THAT(message({"data.lists=[\"a=x\",\"a=y\"]"}), HasSubstr("two lists have one name"));
  EXPECT_THAT(message({"data.lists=[\"a=/nonexistent\"]"}), HasSubstr("/nonexistent"));
  EXPECT_THAT(message({"data.photographed=[b]"}), HasSubstr("no list of data.lists"));
  EXPECT_THAT(message({"data.frames=[/nonexistent]"}), HasSubstr("/nonexistent"));
  EXPECT_THAT(message({"stream.setting=training", "train.epochs=1"}), HasSubstr("train.epochs"));
  EXPECT_THAT(message({"stream.setting=elsewhere"}), HasSubstr("stream.setting"));
  const std::string list = "data.lists=[\"flat=" + (folder / "data").string() + "\"]";
  EXPECT_THAT(message({"model.kind=light", "data.photographs=0.5"}), HasSubstr("data.photographs"));
  EXPECT_THAT(message({"model.kind=light", "data.painted=0.5"}), HasSubstr("data.painted"));
  EXPECT_THAT(message({"model.kind=light", list, "data.photographed=[flat]"}), HasSubstr("data.photographed"));
}

TEST_F(TrainingRun, MemoryThatNoStepFitsIntoIsRefusedByNameAndTheLeastIsEnough) {
  const std::vector<std::string> steps{"train.steps=2", "train.batch=8", "train.memory_mib=1"};
  const std::string said = message_of([&] { run("refused", steps); }, ErrorKind::Usage);
  EXPECT_THAT(said, HasSubstr("train.memory_mib"));
  const std::size_t at = said.find("at least ");
  ASSERT_NE(at, std::string::npos) << said;
  const double least = std::ceil(std::stod(said.substr(at + 9)));
  const auto within = run("within", {steps[0], steps[1], fmt::format("train.memory_mib={}", least)});
  const auto free = run("free", {steps[0], steps[1]});
  const auto one = read_safetensors(within.weights), other = read_safetensors(free.weights);
  ASSERT_EQ(one.tensors.size(), other.tensors.size());
  for (const auto& [name, stored] : one.tensors)
    EXPECT_EQ(stored.floats("within"), other.tensors.at(name).floats("free")) << name;
}

TEST_F(TrainingRun, WeightsOfAnotherShapeAreRefusedByName) {
  const TrainingOutcome outcome = run("runs", {"train.steps=1"});
  const std::string init = "model.init=" + outcome.weights.string();
  EXPECT_THAT(message_of(
                  [&] {
                    run("other", {"train.steps=1", "model.growth=8", init});
                  },
                  ErrorKind::Usage),
              HasSubstr("weights of another net"));

  TensorFile file = read_safetensors(outcome.weights);
  const std::string victim = "encoder.features.conv0.weight";
  StoredTensor& tensor = file.tensors.at(victim);
  tensor.shape = {16, 3, 49};
  const fs::path reshaped = folder / "reshaped.safetensors";
  write_safetensors(reshaped, file);
  const std::string said = message_of(
      [&] {
        run("reshaped", {"train.steps=1", "model.init=" + reshaped.string()});
      },
      ErrorKind::Usage);
  EXPECT_THAT(said, HasSubstr(victim));
  EXPECT_THAT(said, HasSubstr("16x3x49"));
  EXPECT_THAT(said, HasSubstr("16x3x7x7"));

  file.tensors.erase(victim);
  write_safetensors(reshaped, file);
  EXPECT_THAT(message_of(
                  [&] {
                    run("missing", {"train.steps=1", "model.init=" + reshaped.string()});
                  },
                  ErrorKind::Usage),
              HasSubstr(victim));
  EvaluateOptions options;
  options.weights = reshaped, options.data = folder / "data";
  EXPECT_THAT(message_of([&] { evaluate_weights(options); }, ErrorKind::Usage), HasSubstr(victim));
  EXPECT_THAT(message_of(
                  [&] {
                    run("nowhere", {"train.steps=1", "model.init=/nowhere.safetensors"});
                  },
                  ErrorKind::Usage),
              HasSubstr("/nowhere.safetensors"));
  for (const char* root : {"other", "reshaped", "missing", "nowhere"})
    EXPECT_FALSE(fs::exists(folder / root)) << "a refused run left a folder: " << root;
}

TEST_F(TrainingRun, WeightsThatAreNotFiniteAreRefusedByName) {
  const TrainingOutcome outcome = run("runs", {"train.steps=1"});
  const std::string victim = "encoder.features.conv0.weight";
  EvaluateOptions options;
  options.data = folder / "data";
  for (const float value : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
    TensorFile file = read_safetensors(outcome.weights);
    std::get<0>(file.tensors.at(victim).values)[11] = value;
    const fs::path bad = folder / "bad.safetensors";
    write_safetensors(bad, file, FloatStorage::F16);
    const auto named = testing::AllOf(HasSubstr(bad.string()), HasSubstr(victim), HasSubstr("at 11"));
    options.weights = bad;
    EXPECT_THAT(message_of([&] { evaluate_weights(options); }, ErrorKind::Usage), named);
    EXPECT_THAT(message_of(
                    [&] {
                      run("next", {"train.steps=1", "model.init=" + bad.string()});
                    },
                    ErrorKind::Usage),
                named);
    Program exporting({"weights", "export", bad.string(), (folder / "out.safetensors").string()},
                      folder / "export.txt");
    EXPECT_EQ(exporting.wait(), 2);
    EXPECT_THAT(text_of(folder / "export.txt"), named);
    EXPECT_FALSE(fs::exists(folder / "out.safetensors"));
    Program inspecting({"weights", "inspect", bad.string()}, folder / "inspect.txt");
    EXPECT_EQ(inspecting.wait(), 0);
    EXPECT_THAT(text_of(folder / "inspect.txt"), testing::AllOf(HasSubstr(victim), HasSubstr("at 11")));
  }
}

TEST_F(TrainingRun, InspectSaysWhetherThereAreChecksums) {
  const auto inspected = [&](const fs::path& file) {
    Program program({"weights", "inspect", file.string()}, folder / "inspect.txt");
    const int code = program.wait();
    return std::pair(code, text_of(folder / "inspect.txt"));
  };
  TensorFile file;
  file.tensors["w"] = StoredTensor({2}, std::vector<float>{1, 2});
  const fs::path path = folder / "w.safetensors";
  write_safetensors(path, file);
  EXPECT_THAT(inspected(path).second, HasSubstr("checksums agree"));
  rewrite(path, [](std::string& bytes) { bytes.back() ^= 1; });
  EXPECT_EQ(inspected(path).first, 2);
  EXPECT_THAT(inspected(path).second, HasSubstr("tensor w: the tensor is damaged"));
  const std::string header = R"({"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})";
  rewrite(path, [&](std::string& bytes) {
    bytes = std::string(1, static_cast<char>(header.size())) + std::string(7, '\0') + header + std::string(4, '\0');
  });
  EXPECT_EQ(inspected(path).first, 0);
  EXPECT_THAT(inspected(path).second, HasSubstr("no checksums"));
}

TEST_F(TrainingRun, NothingToJudgeIsAnError) {
  EXPECT_THAT(message_of([] { evaluate_weights({}); }, ErrorKind::Usage), HasSubstr("--data"));
}

}  // namespace
}  // namespace clerestory
