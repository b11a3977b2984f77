// Whole runs of `clerestory train` with a tiny net on tiny data, through the real program: interruption, resume to the
// same bits, bad input; and what a run leaves behind, judged again by evaluate.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <thread>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/evaluate.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/cl/tile.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/ops/nn/moving_average.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "host/report/run_directory.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/without_time.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

const std::vector<std::string> tiny_net{
    "model.growth=4",           "model.first=16",         "model.layers=[1,1,1,1]", "model.decoder=[32,16,16,8,4]",
    "model.width=32",           "model.height=32",        "train.batch=2",          "log.every=3",
    "log.checkpoint_minutes=0", "data.validation_views=2"};

struct TrainingRun : testing::Test {
  ScratchFolder folder{"clerestory-training-run"};

  void SetUp() override {
    set_quiet(true);
    write_synthetic_rooms(folder / "data", "train", 2, 4, 32, 32, 5);
    write_synthetic_rooms(folder / "data", "val", 1, 3, 32, 32, 6);
    std::ofstream(folder / "tiny.toml") << "[data]\ntrain = [\"" << (folder / "data").string() << "\"]\n";
  }
  void TearDown() override { set_quiet(false); }

  std::vector<std::string> overrides(const std::string& root, std::vector<std::string> more) const {
    std::vector<std::string> all = tiny_net;
    all.push_back("run.root=" + (folder / root).string());
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Config config(const std::string& root, const std::vector<std::string>& more) const {
    return load_config(folder / "tiny.toml", training_schema(), overrides(root, more));
  }
  TrainingOutcome run(const std::string& root, const std::vector<std::string>& more) const {
    return train(config(root, more), {"clerestory", "train"});
  }
  Program start(const std::string& root, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"train", (folder / "tiny.toml").string()};
    for (const std::string& o : overrides(root, more)) arguments.push_back(o);
    return Program(arguments, folder / (root + ".txt"));
  }
  std::string output_of(const std::string& root) const { return text_of(folder / (root + ".txt")); }
  /// The only run below a root.
  fs::path run_below(const std::string& root) const {
    for (const auto& entry : fs::directory_iterator(folder / root / "train")) return entry.path();
    return {};
  }
};

long newest_checkpoint(const fs::path& root) {
  long newest = -1;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(root, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("step-") && name.ends_with(".safetensors"))
      newest = std::max(newest, std::stol(name.substr(5)));
  }
  return newest;
}

TEST_F(TrainingRun, MinutesAreThoseItWorked) {
  const double minutes = 0.05;
  Program program = start("runs", {fmt::format("train.minutes={}", minutes), "log.checkpoint_every=5"});
  ASSERT_TRUE(wait_until([&] { return newest_checkpoint(folder / "runs") >= 0; })) << output_of("runs");
  program.signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::seconds(6));  // longer than the whole leg
  program.signal(SIGCONT);
  ASSERT_EQ(program.wait(), 0) << output_of("runs");
  const double seconds = read_provenance(run_below("runs") / "provenance.json").figures.at("seconds");
  EXPECT_GE(seconds, 60 * minutes);
  EXPECT_LE(seconds, 60 * minutes + 2) << "its last step and validation";
}

// A run that was begun in a tile that is not this device's fastest goes on in it; begun on another device, in the
// fastest.
TEST_F(TrainingRun, GoesOnInTheTileThatItBeganWith) {
  const std::string own = Device::open().tile().name, other = own == "4x12" ? "8x12" : "4x12";
  const std::vector<std::string> settings{"train.steps=120", "log.checkpoint_every=10"};
  for (const bool same_device : {true, false}) {
    const std::string root = same_device ? "same" : "moved";
    std::vector<std::string> forced = settings;
    forced.push_back("run.tile=" + other);
    Program program = start(root, forced);
    EXPECT_TRUE(wait_until([&] { return newest_checkpoint(folder / root) >= 0; })) << output_of(root);
    program.signal(SIGINT);
    ASSERT_EQ(program.wait(), 4) << output_of(root);
    const fs::path record = run_below(root) / "provenance.json";
    Provenance begun = read_provenance(record);
    EXPECT_EQ(begun.facts.at("tile"), other);
    if (!same_device) {
      begun.device += " of another machine";
      write_provenance(record, begun);
    }
    const TrainingOutcome outcome = run(root, settings);
    EXPECT_EQ(outcome.folder, run_below(root)) << "not gone on with";
    EXPECT_EQ(read_provenance(record).facts.at("tile"), same_device ? other : own);
  }
}

TEST_F(TrainingRun, InterruptedAndKilledItEndsInTheSameBits) {
  const std::vector<std::string> settings{"train.steps=240", "log.checkpoint_every=10", "log.validate_every=25",
                                          "train.average=0.9"};
  Program whole = start("runs", settings);
  ASSERT_EQ(whole.wait(), 0) << output_of("runs");
  const std::string name = run_below("runs").filename();
  fs::rename(folder / "runs", folder / "whole");  // the same command again, in the same place
  const fs::path unbroken = folder.path() / "whole/train" / name, run = folder.path() / "runs/train" / name;
  const auto stopped_after = [&](const std::function<bool()>& condition, int number) {
    Program program = start("runs", settings);
    EXPECT_TRUE(wait_until(condition)) << output_of("runs");
    program.signal(number);
    const int code = program.wait();
    EXPECT_FALSE(fs::exists(run / "DONE")) << "it was done before it was stopped";
    return code;
  };
  const auto checkpoint = [&](long step) { return [&, step] { return newest_checkpoint(run) >= step; }; };

  // Before the first checkpoint, so that it begins anew; asked to stop; killed twice more.
  EXPECT_EQ(stopped_after([&] { return fs::exists(run / "metrics.jsonl"); }, SIGKILL), 128 + SIGKILL);
  EXPECT_EQ(stopped_after(checkpoint(20), SIGTERM), 4) << output_of("runs");
  EXPECT_THAT(output_of("runs"), HasSubstr("the same command goes on"));
  for (int kills = 0; kills < 2; ++kills)
    EXPECT_EQ(stopped_after(checkpoint(newest_checkpoint(run) + 10), SIGKILL), 128 + SIGKILL);
  ASSERT_LT(newest_checkpoint(run), 240);

  Program last = start("runs", settings);
  ASSERT_EQ(last.wait(), 0) << output_of("runs");
  EXPECT_THAT(output_of("runs"), HasSubstr("goes on after step"));
  const auto expected = without_time(unbroken), found = without_time(run);
  EXPECT_EQ(files_below(run), files_below(unbroken));
  for (const auto& [file, kept] : {std::pair{"report.html", "data:image/png"},
                                   {"report.html", "<table>"},
                                   {"log.txt", "step 240: score"},
                                   {"artifacts/card.md", "| normals |"}})
    EXPECT_THAT(expected.at(file), HasSubstr(kept)) << "nothing of it is compared";
  for (const auto& [file, content] : expected)
    EXPECT_TRUE(found.count(file) && found.at(file) == content) << file << " differs by more than time";
  EXPECT_EQ(read_safetensors(run / "checkpoints/step-00000240.safetensors").metadata.at("step"), "240");
  EXPECT_EQ(read_metrics(run / "metrics.jsonl").size(),
            240u / 3 + 240 / 25 + 2);  // losses, validations, and those at the start and the end
}

// Rooms made on the way, fixed lists beside the validation, second moments for the next leg.
TEST_F(TrainingRun, StreamedItEndsInTheSameBitsWhenKilledAndIsJudgedByLists) {
  const std::string lists = "data.lists=[\"flat=" + (folder / "data").string() + "\"]";
  const std::vector<std::string> settings{"train.steps=24",
                                          "log.checkpoint_every=4",
                                          "log.validate_every=12",
                                          "stream.times=4",
                                          "stream.window=2",
                                          "stream.views=1",
                                          "stream.spp=1",
                                          "stream.scale=1",
                                          "stream.setting=training",
                                          "stream.fixed=0.2",
                                          "stream.crop=0.8",
                                          "data.photographs=0.5",
                                          "data.photographed=[flat]",
                                          lists};
  const TrainingOutcome whole = run("whole", settings);
  {
    Program program = start("runs", settings);
    EXPECT_TRUE(wait_until([&] { return newest_checkpoint(folder / "runs") >= 8; })) << output_of("runs");
    program.signal(SIGKILL);
    program.wait();
    ASSERT_LT(newest_checkpoint(folder / "runs"), 24);
  }
  const TrainingOutcome resumed = run("runs", settings);
  EXPECT_EQ(resumed.folder.filename(), whole.folder.filename());
  EXPECT_FALSE(fs::exists(resumed.folder / "stream")) << "rooms stay behind";
  const TensorFile one = read_safetensors(whole.weights), other = read_safetensors(resumed.weights);
  ASSERT_EQ(one.tensors.size(), other.tensors.size());
  for (const auto& [name, tensor] : one.tensors) EXPECT_EQ(tensor.values, other.tensors.at(name).values) << name;

  // The last weights: what validation likes best may be those of step 12.
  const fs::path last_weights = resumed.folder / "artifacts/last.safetensors";
  const History history = read_history(last_weights);
  const Leg& leg = history.legs.at(0);
  EXPECT_EQ(leg.rooms, 2 + 2 + 24 * 2 / 4);  // two fixed ones, a window, and those that came
  EXPECT_EQ(leg.views, 8 + 2 + 12);
  const HistoryPoint& last = leg.curve.back();
  ASSERT_EQ(last.lists.size(), 2u);
  EXPECT_EQ(last.lists[0].list, "flat");
  EXPECT_EQ(last.lists[0].views, 11);  // of train.txt and of val.txt
  EXPECT_EQ(last.lists[1].list, "flat, photographed");
  EXPECT_NE(last.lists[0].errors, last.lists[1].errors);
  EXPECT_THAT(text_of(resumed.folder / "report.html"), HasSubstr("Fixed lists"));

  run("next", {"train.steps=2", "model.init=" + last_weights.string()});
  EXPECT_THAT(text_of(run_below("next") / "log.txt"), HasSubstr("with the second moments"));
  EXPECT_EQ(stored_moments(read_safetensors(run_below("next") / "artifacts/last.safetensors"), "test").steps, 26);
}

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
  EXPECT_THAT(message({"model.kind=light", list, "data.photographed=[flat]"}), HasSubstr("data.photographed"));
}

TEST_F(TrainingRun, ItsPageHasCurvesAndPicturesFirstAndNoFolders) {
  const std::string list = "data.lists=[\"flat=" + (folder / "data").string() + "\"]";
  const std::string page = text_of(run("runs", {"train.steps=2", list}).folder / "report.html");
  std::size_t at = 0;
  for (const char* next : {">Validation<", "class=\"plot\"", ">Validation views<", "<span>predicted</span>",
                           "class=\"bar-of-colours", "val_room_0/", ">Errors<", "<table>", ">Losses<",
                           ">How it was made<", "class=\"facts\"", ">Configuration<", "flat=data"}) {
    at = page.find(next, at);
    ASSERT_NE(at, std::string::npos) << next << " is missing, or stands before what comes before it";
  }
  EXPECT_THAT(page, testing::Not(HasSubstr(folder.path().string())));
}

TEST_F(TrainingRun, LeavesWeightsThatEvaluateAsItsLastValidationDid) {
  const TrainingOutcome outcome =
      run("runs", {"train.steps=20", "log.validate_every=0", "log.checkpoint_every=7", "data.validation_views=0"});
  EXPECT_FALSE(outcome.skipped);
  for (const char* file : {"DONE", "report.html", "provenance.json", "config.resolved.toml", "log.txt",
                           "artifacts/card.md", "artifacts/validation.svg"})
    EXPECT_TRUE(fs::exists(outcome.folder / file)) << file;
  int checkpoints = 0;
  for (const auto& entry : fs::directory_iterator(outcome.folder / "checkpoints"))
    checkpoints += entry.is_regular_file();
  EXPECT_EQ(checkpoints, 2);

  EvaluateOptions options;
  options.weights = outcome.weights, options.data = folder / "data";
  const EvaluateOutcome judged = evaluate_weights(options);
  ASSERT_EQ(judged.views.size(), 3u);
  const auto metadata = read_safetensors(outcome.weights).metadata;
  // Weights are rounded to half, 2^-11 each: an error that is no sum of many such may move by a hundred times that.
  EXPECT_NEAR(judged.summary.score(), std::stod(metadata.at("score")), 100 * 0x1p-11 * judged.summary.score());
  EXPECT_NEAR(judged.summary.find(MapError::Normal)->ours.mean, std::stod(metadata.at("error.normal_degrees")), 1);
  EXPECT_EQ(metadata.at("views_seen"), "40");
  EXPECT_EQ(judged.summary.find(MapError::Albedo)->mean_map.count, 3);  // mean maps travelled with the weights
  options.batch = 2;                                                    // a last group that is not full
  EXPECT_EQ(evaluate_weights(options).summary.find(MapError::Depth)->ours.mean,
            judged.summary.find(MapError::Depth)->ours.mean);

  EXPECT_TRUE(
      run("runs", {"train.steps=20", "log.validate_every=0", "log.checkpoint_every=7", "data.validation_views=0"})
          .skipped);

  // exported again from the checkpoint: the same numbers, with a card
  Program exporting({"weights", "export", (outcome.folder / "checkpoints/step-00000020.safetensors").string(),
                     (folder / "out/maps.safetensors").string()},
                    folder / "export.txt");
  ASSERT_EQ(exporting.wait(), 0) << text_of(folder / "export.txt");
  const TensorFile exported = read_safetensors(folder / "out/maps.safetensors"),
                   written = read_safetensors(outcome.folder / "artifacts/last.safetensors");
  ASSERT_EQ(exported.tensors.size(), written.tensors.size());
  for (const auto& [name, tensor] : written.tensors) EXPECT_EQ(exported.tensors.at(name).values, tensor.values) << name;
  EXPECT_THAT(text_of(folder / "out/CARD.md"), HasSubstr("maps.safetensors"));

  // the next leg carries the history on
  const TrainingOutcome next = run("next", {"train.steps=4", "run.seed=2", "model.init=" + outcome.weights.string()});
  const History history = history_from_json(read_safetensors(next.weights).metadata.at("history"), "test");
  ASSERT_EQ(history.legs.size(), 2u);
  EXPECT_EQ(history.views_seen(), 48);
  EXPECT_EQ(history.legs[1].init, "weights.safetensors");
  EXPECT_GT(history.legs[1].curve[0].hours, 0);
}

TEST_F(TrainingRun, ASecondLegOfOneSeedGoesOnWithTheBatchesOfTheFirst) {
  const TrainingOptions options = training_options(config("legs", {"train.steps=4", "data.flip=false"}));
  const auto views_of_leg = [&](std::int64_t before, int steps) {
    const Device device = Device::open();
    const auto states = std::make_shared<States>(device);
    const auto task = maps_task(device, options, {states, states});
    TrainingProgress progress;
    progress.history.legs.resize(2);
    progress.history.legs[0].views_seen = before;
    task->begin(progress);
    std::vector<std::vector<std::string>> views;
    for (int i = 0; i < steps; ++i) task->step(0), views.push_back(task->last_views());
    return views;
  };
  const auto first = views_of_leg(0, 4), second = views_of_leg(4, 2);  // batches of two, eight views
  EXPECT_EQ(second[0], first[2]);
  EXPECT_EQ(second[1], first[3]);
  EXPECT_NE(second[0], first[0]);
}

TEST_F(TrainingRun, ASharedDecoderTrainsAndItsWeightsAreReadAsSuch) {
  const TrainingOutcome outcome =
      run("runs", {"train.steps=4", "model.preset=shared", "model.decoder=[16,16,8,8,8,8]", "data.validation_views=0"});
  EvaluateOptions options;
  options.weights = outcome.weights, options.data = folder / "data";
  const auto metadata = read_safetensors(outcome.weights).metadata;
  EXPECT_THAT(metadata.at("net"), HasSubstr("shared decoder 16-16-8-8-8-8"));
  const double score = evaluate_weights(options).summary.score();
  EXPECT_NEAR(score, std::stod(metadata.at("score")), 100 * 0x1p-11 * score);  // weights are rounded to half
}

// Through files: what the first leg's weights say of the views they saw is where the second begins.
TEST_F(TrainingRun, WeightsCarryWhereTheNextLegBegins) {
  const TrainingOutcome first = run("first", {"train.steps=3"});
  const History history = read_history(first.weights);
  const std::int64_t seen = history.views_seen();
  EXPECT_GT(seen, 0);
  const TrainingOutcome second = run("second", {"train.steps=1", "model.init=" + first.weights.string()});
  const History both = read_history(second.weights);
  ASSERT_EQ(both.legs.size(), 2u);
  EXPECT_EQ(both.views_seen_before(), seen);
  EXPECT_EQ(both.views_seen(), seen + 2);
}

TEST_F(TrainingRun, AveragesOfTheWeightsAreJudgedAndKept) {
  const TrainingOutcome first = run("first", {"train.steps=20", "train.average=0.9"});
  const TensorFile kept = read_safetensors(first.weights),
                   checkpoint = read_safetensors(first.folder / "checkpoints/step-00000020.safetensors");
  int averages = 0, apart = 0;
  for (const auto& [name, tensor] : kept.tensors) {
    if (checkpoint.tensors.count(average_name(name)) == 0) continue;
    ++averages;
    const std::vector<float> average = checkpoint.get(average_name(name), "checkpoint").floats(),
                             parameter = checkpoint.get(name, "checkpoint").floats(), stored = tensor.floats();
    for (std::size_t i = 0; i < stored.size(); ++i) {
      ASSERT_NEAR(stored[i], average[i], 0x1p-11 * std::abs(average[i]) + 0x1p-24) << name;  // half precision
      apart += std::abs(parameter[i] - average[i]) > 0.01 * std::abs(average[i]) ? 1 : 0;
    }
  }
  EXPECT_GT(averages, 40);
  EXPECT_GT(apart, 1000) << "the average is the parameters";

  const TrainingOutcome second =
      run("second", {"train.steps=1", "train.rate=0", "train.average=0.9", "model.init=" + first.weights.string()});
  const TensorFile again = read_safetensors(second.weights);
  for (const auto& [name, tensor] : kept.tensors) {
    if (checkpoint.tensors.count(average_name(name)) == 0) continue;
    EXPECT_EQ(again.get(name, "weights").floats(), tensor.floats()) << name;
  }
}

TEST_F(TrainingRun, LearnsItsOwnViews) {
  const TrainingOutcome outcome = run("runs", {"train.steps=150", "train.rate=3e-3", "log.validate_every=0",
                                               "log.checkpoint_every=0", "data.flip=false"});
  const Curve loss = curve_of(read_metrics(outcome.folder / "metrics.jsonl"), "train/loss");
  ASSERT_EQ(loss.values.size(), 50u);
  double first = 0, last = 0;
  for (int i = 0; i < 5; ++i) first += loss.values[i] / 5, last += loss.values[49 - i] / 5;
  EXPECT_LT(last, 0.5 * first);
}

TEST_F(TrainingRun, LossThatIsNotFiniteNamesStepAndViews) {
  Program program = start("runs", {"train.steps=20", "train.rate=10", "train.schedule=constant", "train.beta1=0",
                                   "log.validate_every=0", "log.checkpoint_every=0", "loss.scale=1e38"});
  EXPECT_EQ(program.wait(), 1);
  const std::string said = output_of("runs");
  EXPECT_THAT(said, HasSubstr("at step"));
  EXPECT_THAT(said, HasSubstr("train_room_"));
  EXPECT_TRUE(fs::exists(run_below("runs") / "FAILED"));
  EXPECT_FALSE(fs::exists(run_below("runs") / "DONE"));
}

// A step at a rate of 0 for the encoder leaves it as the program's file has it.
TEST_F(TrainingRun, LiteBeginsWithWhatItsEncoderLearnedOnImagenet) {
  const auto lite = [&](const std::string& root, std::vector<std::string> more) {
    more.insert(more.end(), {"model.preset=lite", "model.decoder=[8,8,8,8,8,8]", "model.width=32", "model.height=32",
                             "train.batch=2", "train.steps=1", "train.encoder_rate=0", "data.validation_views=0",
                             "run.root=" + (folder / root).string()});
    return train(load_config(folder / "tiny.toml", training_schema(), more), {"clerestory", "train"});
  };
  const TensorFile learned = read_safetensors(imagenet_encoder());
  const auto differing = [&](const TrainingOutcome& outcome) {
    const TensorFile weights = read_safetensors(outcome.weights);
    int count = 0;
    for (const auto& [name, tensor] : learned.tensors)
      count += weights.get(name, "weights").floats() != tensor.floats() ? 1 : 0;
    return count;
  };
  const TrainingOutcome outcome = lite("imagenet", {});
  EXPECT_EQ(differing(outcome), 0);
  EXPECT_EQ(read_history(outcome.weights).legs[0].init, "imagenet_lite0.safetensors");
  const TrainingOutcome random = lite("random", {"model.encoder=random"});
  EXPECT_EQ(differing(random), static_cast<int>(learned.tensors.size()));
  EXPECT_EQ(read_history(random.weights).legs[0].init, "");
  const std::string said =
      message_of([&] { lite("other", {"model.channels=[16,24,48,80,112,192,320]"}); }, ErrorKind::Usage);
  EXPECT_THAT(said, HasSubstr("imagenet_lite0.safetensors"));
  EXPECT_THAT(said, HasSubstr("encoder.stage2.0.project"));
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
    EXPECT_TRUE(run_below(root).empty()) << "a refused run left a folder below " << root;
}

void rewrite(const fs::path& path, const std::function<void(std::string&)>& change) {
  std::string bytes = text_of(path);
  change(bytes);
  std::ofstream(path, std::ios::binary) << bytes;
}

// A disk that filled up, a power cut, a bit that fell over: ten steps are lost, not the run.
TEST_F(TrainingRun, DamagedNewestCheckpointFallsBackToTheOneBefore) {
  const std::vector<std::string> settings{"train.steps=20", "log.validate_every=0", "log.checkpoint_every=10"};
  const fs::path run_folder = run("runs", settings).folder;
  const auto unbroken = without_time(run_folder);
  const fs::path newest = run_folder / "checkpoints/step-00000020.safetensors",
                 before = run_folder / "checkpoints/step-00000010.safetensors";
  const std::string whole = text_of(newest), whole_before = text_of(before);
  struct Damage {
    std::string what, said;  // said: what the log must name beside the file
    std::function<void()> make;
  };
  const auto flip = [&](std::size_t at) { rewrite(newest, [=](std::string& bytes) { bytes[at] ^= 0x10; }); };
  for (const Damage& damage : std::vector<Damage>{
           {"a byte of a tensor", "is damaged", [&] { flip(whole.size() - 100); }},
           {"cut short", "", [&] { fs::resize_file(newest, whole.size() / 2); }},
           {"a value that is not finite", "encoder.features.conv0.weight: a value is not finite (found nan at 7)", [&] {
              TensorFile file = read_safetensors(newest);
              std::get<0>(file.tensors.at("encoder.features.conv0.weight").values)[7] = std::nanf("");
              write_safetensors(newest, file);
            }}}) {
    SCOPED_TRACE(damage.what);
    fs::remove(run_folder / "DONE");
    rewrite(newest, [&](std::string& bytes) { bytes = whole; });
    rewrite(before, [&](std::string& bytes) { bytes = whole_before; });
    damage.make();
    fs::remove(run_folder / "log.txt");
    run("runs", settings);
    const std::string log = text_of(run_folder / "log.txt");
    EXPECT_THAT(log, HasSubstr(newest.string()));
    EXPECT_THAT(log, HasSubstr(damage.said));
    EXPECT_THAT(log, HasSubstr("goes on after step 10 "));
    EXPECT_EQ(read_safetensors(newest).metadata.at("step"), "20") << "it was made again; its hours are others";
    EXPECT_TRUE(fs::remove(newest.string() + ".damaged")) << "what is damaged is set aside, not deleted";
    auto found = without_time(run_folder);
    found["log.txt"] = unbroken.at("log.txt");  // says less of the steps: those before it was broken are gone
    for (const auto& [file, content] : unbroken)
      EXPECT_TRUE(found.count(file) && found.at(file) == content) << file << " differs by more than time";
    EXPECT_EQ(found.size(), unbroken.size());
  }

  // Both: it does not begin anew by itself.
  fs::remove(run_folder / "DONE");
  fs::resize_file(newest, 0), fs::resize_file(before, 10);
  const std::string said = message_of([&] { run("runs", settings); }, ErrorKind::Usage);
  EXPECT_THAT(said, HasSubstr(newest.string()));
  EXPECT_THAT(said, HasSubstr(before.string()));
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

TEST_F(TrainingRun, OtherViewsThanItBeganWithAreRefused) {
  const std::vector<std::string> settings{"train.steps=6", "log.checkpoint_every=2", "log.validate_every=0"};
  const TrainingOutcome outcome = run("runs", settings);
  fs::remove(outcome.folder / "DONE");
  write_synthetic_rooms(folder / "data", "train", 2, 5, 32, 32, 5);
  EXPECT_THAT(message_of([&] { run("runs", settings); }, ErrorKind::Usage), HasSubstr("training views"));
}

TEST_F(TrainingRun, RunFolderOfItsOwnTruthHasNoError) {
  const fs::path view = folder / "data/val_room_0/000", gbuffer = folder / "run";
  const RoomView truth = read_view(view);
  fs::create_directories(gbuffer);
  write_exr(gbuffer / "albedo.exr", truth.albedo);
  write_exr(gbuffer / "normal.exr", truth.normal);
  Image twice = truth.depth;
  for (float& d : twice.data) d *= 2;
  write_exr(gbuffer / "depth.exr", twice, ExrType::Float);
  EXPECT_THAT(message_of([&] { evaluate_run(gbuffer, view); }, ErrorKind::Usage), HasSubstr("a map is missing"));
  write_exr(gbuffer / "material.exr", truth.material);
  const EvaluateOutcome judged = evaluate_run(gbuffer, view);
  // files in half: relative 2^-11 on albedo and material; depth in float against depth stored in millimetres
  EXPECT_NEAR(judged.summary.find(MapError::Normal)->ours.mean, 0, 1e-3);
  EXPECT_NEAR(judged.summary.find(MapError::Depth)->ours.mean, 0, 1e-6);
  EXPECT_NEAR(judged.summary.find(MapError::Albedo)->ours.mean, 0, 0x1p-22);
  EXPECT_NEAR(judged.summary.find(MapError::Roughness)->ours.mean, 0, 0x1p-22);
  EXPECT_NEAR(judged.summary.median_log_scale_error, std::log(2.0), 1e-6);
  EXPECT_THAT(message_of([&] { evaluate_run(gbuffer, folder / "data"); }, ErrorKind::Usage),
              HasSubstr("no generated view"));
}

TEST_F(TrainingRun, NothingToJudgeIsAnError) {
  EXPECT_THAT(message_of([] { evaluate_weights({}); }, ErrorKind::Usage), HasSubstr("--data"));
}

}  // namespace
}  // namespace clerestory
