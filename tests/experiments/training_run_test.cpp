// What a run of training leaves behind, judged again by evaluate: weights, averages, histories, what the next leg
// reads.
#include "tests/experiments/training_run.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/evaluate.hpp"
#include "experiments/training/schema.hpp"
#include "experiments/training/task.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/datasets.hpp"
#include "host/io/image.hpp"
#include "host/ops/nn/moving_average.hpp"
#include "host/report/metrics.hpp"
#include "tests/experiments/program.hpp"
#include "tests/message_of.hpp"
#include "tests/roundings.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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
  const double degrees = judged.summary.find(MapError::Normal)->ours.mean;
  EXPECT_NEAR(degrees, std::stod(metadata.at("error.normal_degrees")), 100 * 0x1p-11 * degrees);
  EXPECT_EQ(metadata.at("views_seen"), "40");
  EXPECT_EQ(judged.summary.find(MapError::Albedo)->mean_map.count, 3);  // mean maps travelled with the weights
  EXPECT_EQ(judged.summary.find(MapError::Albedo)->rivals[0].count, 0) << "nobody asked for them";
  options.rivals = true;
  options.batch = 2;  // a last group that is not full
  EXPECT_EQ(evaluate_weights(options).summary.find(MapError::Albedo)->rivals[0].count, 3);
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

// Weights of three legs: the first, one that goes on from it, and one that has nothing to do with them.
TEST_F(TrainingRun, LegsOfOneTrainingHaveAMean) {
  const fs::path first = run("first", {"train.steps=3"}).weights,
                 next = run("next", {"train.steps=5", "run.seed=2", "model.init=" + first.string()}).weights,
                 other = run("other", {"train.steps=3", "run.seed=3"}).weights, mean = folder / "out/mean.safetensors";
  const auto says = [&](const std::vector<fs::path>& files, int code) {
    std::vector<std::string> words{"weights", "average"};
    words.insert(words.end(), files.begin(), files.end());
    EXPECT_EQ(Program(words, folder / "said.txt").wait(), code);
    return text_of(folder / "said.txt");
  };
  EXPECT_THAT(says({mean, first, first, next}, 0), HasSubstr(mean.string()));
  const TensorFile a = read_safetensors(first), b = read_safetensors(next), m = read_safetensors(mean);
  int moved = 0;
  for (const auto& [name, shape] : maps_states(load_weights(mean, Device::open()).net)) {
    const std::vector<float>&of_a = a.get(name, "a").floats(), &of_b = b.get(name, "b").floats(),
          &of_mean = m.get(name, "mean").floats();
    for (std::size_t i = 0; i < of_mean.size(); ++i) {
      const double x = static_cast<double>(of_a[i]), y = static_cast<double>(of_b[i]);
      const double expected = (2 * x + y) / 3;
      // Rounded to half: 2^-11 of the number, or half of the least step below 2^-14.
      ASSERT_NEAR(static_cast<double>(of_mean[i]), expected, 0x1.01p-11 * std::abs(expected) + 0x1p-25) << name;
      moved += x != y;
    }
  }
  EXPECT_GT(moved, 1000);
  const History history = read_history(mean);
  ASSERT_EQ(history.legs.size(), 3u);
  EXPECT_EQ(history.views_seen(), 2 * (3 + 5));
  EXPECT_EQ(history.legs[0].steps, 3);
  EXPECT_EQ(history.legs[1].steps, 5);
  EXPECT_EQ(history.legs[2].init,
            fmt::format("mean of weights.safetensors ({0}), weights.safetensors ({0}), weights.safetensors ({1})",
                        record_file(first).hash, record_file(next).hash));
  EXPECT_EQ(history.legs[2].views_seen, 0);
  EXPECT_EQ(read_moments(mean).steps, read_moments(next).steps);
  EXPECT_EQ(m.get("mean_maps.mean", "mean").values, b.get("mean_maps.mean", "next").values);
  EXPECT_FALSE(m.metadata.contains("score")) << "nobody has judged it";

  // Of a checkpoint its averages are taken, which are what the weights file of its step has.
  const TrainingOutcome averaged = run("averaged", {"train.steps=4", "train.average=0.5", "log.checkpoint_every=2"});
  const fs::path last = averaged.folder / "checkpoints/step-00000004.safetensors",
                 same = folder / "out/same.safetensors";
  says({same, last, averaged.folder / "artifacts/last.safetensors"}, 0);
  const TensorFile of_last = read_safetensors(averaged.folder / "artifacts/last.safetensors"),
                   of_same = read_safetensors(same);
  for (const auto& [name, shape] : maps_states(load_weights(same, Device::open()).net)) {
    const std::vector<float>&a_last = of_last.get(name, "last").floats(), &a_same = of_same.get(name, "same").floats();
    for (std::size_t i = 0; i < a_last.size(); ++i)
      ASSERT_NEAR(a_same[i], a_last[i], 0x1.01p-10f * std::abs(a_last[i]) + 0x1p-24f) << name;
  }
  EXPECT_EQ(read_history(same).legs.size(), 2u);
  EXPECT_EQ(read_history(same).legs[0].steps, 4);

  // Judged without a change, it goes on from there.
  const TrainingOutcome judged =
      run("judged", {"train.steps=1", "train.rate=0", "run.seed=4", "model.init=" + mean.string()});
  const TensorFile after = read_safetensors(judged.weights);
  for (const auto& [name, tensor] : m.tensors) {
    const bool learned = name.ends_with("weight") && name.starts_with("encoder");
    if (learned) {
      EXPECT_EQ(after.tensors.at(name).values, tensor.values) << name;
    }
  }
  EXPECT_TRUE(after.metadata.contains("score"));

  EXPECT_THAT(says({mean, first, next}, 2), HasSubstr("is there already"));
  const fs::path out = folder / "out/more.safetensors";
  EXPECT_THAT(says({out, first}, 2), HasSubstr("FILE"));
  EXPECT_THAT(says({out, first, other}, 2), HasSubstr("another first leg"));
  const fs::path large = run("large", {"train.steps=1", "model.width=64", "model.init=" + first.string()}).weights;
  EXPECT_THAT(says({out, first, large}, 2), HasSubstr("another size of view"));
  const fs::path small = run("small", {"train.steps=1", "model.growth=8"}).weights;
  EXPECT_THAT(says({out, first, small}, 2), HasSubstr("another net"));
  EXPECT_FALSE(fs::exists(out));
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

// A leg of albedo alone leaves the other decoders, and the next one of all finds what Adam knew of all.
TEST_F(TrainingRun, ALegOfOneTermPassesOnWhatIsKnownOfTheRest) {
  const TrainingOutcome first = run("first", {"train.steps=4"});
  const TrainingOutcome part = run("part", {"train.steps=4", "log.checkpoint_every=2", "loss.normal=0",
                                            "loss.material=0", "loss.depth=0", "model.init=" + first.weights.string()});
  const fs::path last = part.folder / "artifacts/last.safetensors",
                 midway = part.folder / "checkpoints/step-00000002.safetensors";
  const Moments before = read_moments(first.weights), after = read_moments(last);
  int kept = 0, moved = 0;
  for (const auto& [name, tensor] : before.tensors) {
    const bool same = after.tensors.at(name).values == tensor.values;
    for (const char* decoder : {".decoder_normal.", ".decoder_material.", ".decoder_depth."}) {
      if (name.find(decoder) == std::string::npos) continue;
      EXPECT_TRUE(same) << name;
      ++kept;
    }
    if (name.find(".decoder_albedo.") != std::string::npos) moved += same ? 0 : 1;
  }
  EXPECT_GT(kept, 10);
  EXPECT_GT(moved, 10);
  for (const fs::path& from : {last, midway}) {
    run("next" + from.stem().string(), {"train.steps=1", "run.seed=2", "model.init=" + from.string()});
    EXPECT_THAT(text_of(run_below("next" + from.stem().string()) / "log.txt"), HasSubstr("with the second moments"));
  }
}

TEST_F(TrainingRun, WhereNoStepIsBetterTheWeightsThatItBeganWithAreHandedOut) {
  const TrainingOutcome first = run("first", {"train.steps=60", "train.rate=3e-3"});
  const TrainingOutcome worse = run("worse", {"train.steps=2", "train.rate=1", "log.validate_every=1",
                                              "train.runaway=0", "model.init=" + first.weights.string()});
  const TensorFile a = read_safetensors(first.weights), b = read_safetensors(worse.weights);
  for (const auto& [name, shape] : maps_states(load_weights(first.weights, Device::open()).net))
    EXPECT_EQ(b.tensors.at(name).values, a.tensors.at(name).values) << name;
  const History history = read_history(worse.weights);
  EXPECT_EQ(history.legs.back().steps, 0);
  EXPECT_THAT(text_of(worse.folder / "log.txt"), HasSubstr("weights of step 0, with which it began"));
  EXPECT_THAT(text_of(worse.folder / "artifacts/card.md"), HasSubstr("120 views seen, 2 legs"))
      << "of the file it names";
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
  EXPECT_NEAR(judged.summary.find(MapError::Normal)->ours.mean, 0, 180 * 4 * kFloatRounding);
  EXPECT_NEAR(judged.summary.find(MapError::Depth)->ours.mean, 0, 4 * kFloatRounding);
  EXPECT_NEAR(judged.summary.find(MapError::Albedo)->ours.mean, 0, 0x1p-22);
  EXPECT_NEAR(judged.summary.find(MapError::Roughness)->ours.mean, 0, 0x1p-22);
  EXPECT_NEAR(judged.summary.median_log_scale_error, std::log(2.0), 4 * kFloatRounding);

  // Whether these maps are of that picture only the run can tell.
  EXPECT_EQ(judged.facts.back(), (std::pair<std::string, std::string>{"photograph", "not recorded"}));
  const auto said_of = [&](const char* picture) {
    Provenance made;
    made.inputs = {record_file(folder / picture)};
    write_provenance(gbuffer / "provenance.json", made);
    return evaluate_run(gbuffer, view).facts.back().second;
  };
  EXPECT_EQ(said_of("data/val_room_0/000_im.exr"), (folder / "data/val_room_0/000_im.exr").string());
  EXPECT_THAT(said_of("data/val_room_0/001_im.exr"), HasSubstr("other bytes than " + view.string() + "_im.exr"));
  EXPECT_THAT(message_of([&] { evaluate_run(gbuffer, folder / "data"); }, ErrorKind::Usage),
              HasSubstr("no generated view"));
}

}  // namespace
}  // namespace clerestory
