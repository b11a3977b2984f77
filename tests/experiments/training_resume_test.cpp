// Training that is stopped, killed or damaged, through the real program: it goes on to the same bits, or says why not.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/trainer.hpp"
#include "experiments/weights/weights.hpp"
#include "host/cl/tile.hpp"
#include "host/error.hpp"
#include "host/report/metrics.hpp"
#include "host/report/run_directory.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/training_run.hpp"
#include "tests/experiments/without_time.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

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
  EXPECT_EQ(last.lists[1].list, "flat, photographed as JPEG");
  EXPECT_NE(last.lists[0].errors, last.lists[1].errors);
  EXPECT_THAT(text_of(resumed.folder / "report.html"), HasSubstr("flat, photographed"));

  run("next", {"train.steps=2", "model.init=" + last_weights.string()});
  EXPECT_THAT(text_of(run_below("next") / "log.txt"), HasSubstr("with the second moments"));
  EXPECT_EQ(stored_moments(read_safetensors(run_below("next") / "artifacts/last.safetensors"), "test").steps, 26);
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

// States lie on the device: what was done since the last checkpoint goes with it, and nothing else.
TEST_F(TrainingRun, ALostDeviceLeavesTheLastCheckpoint) {
  const std::vector<std::string> settings{"train.steps=40", "log.checkpoint_every=2", "log.validate_every=0"};
  const TrainingOutcome whole = run("whole", settings);
  std::vector<std::string> words{"train", (folder / "tiny.toml").string()};
  for (const std::string& word : overrides("runs", settings)) words.push_back(word);
  long newest = -1;
  for (int launches = 500; newest < 2 && launches < 1000000; launches *= 2) {
    Program program(words, folder / "runs.txt", {{}, {{"CLERESTORY_PRETEND", fmt::format("lost_after={}", launches)}}});
    ASSERT_EQ(program.wait(), 3) << launches << ": " << output_of("runs");
    EXPECT_THAT(output_of("runs"), HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
    newest = newest_checkpoint(folder / "runs");
    EXPECT_THAT(output_of("runs"),
                HasSubstr(newest < 0 ? "begins anew" : fmt::format("goes on after step {}", newest)));
  }
  ASSERT_GE(newest, 2);
  const TensorFile one = read_safetensors(whole.weights), other = read_safetensors(run("runs", settings).weights);
  ASSERT_EQ(one.tensors.size(), other.tensors.size());
  for (const auto& [name, tensor] : one.tensors) EXPECT_EQ(tensor.values, other.tensors.at(name).values) << name;
}

// Best weights are no part of the checkpoint: they may be damaged while it is whole.
TEST_F(TrainingRun, DamagedBestWeightsAreSetAsideAndNotHandedOut) {
  const std::vector<std::string> settings{"train.steps=20", "log.validate_every=5", "log.checkpoint_every=10"};
  const fs::path run_folder = run("runs", settings).folder, artifacts = run_folder / "artifacts",
                 best = artifacts / "best.safetensors", given = artifacts / "weights.safetensors";
  const std::uintmax_t size = fs::file_size(best);
  fs::copy(run_folder, folder / "kept", fs::copy_options::recursive);
  const auto again = [&](const std::function<void()>& damage) {
    fs::remove_all(run_folder);
    fs::copy(folder / "kept", run_folder, fs::copy_options::recursive);
    fs::remove(run_folder / "DONE"), fs::remove(run_folder / "log.txt"), fs::remove(given);
    damage();
    run("runs", settings);
    return text_of(run_folder / "log.txt");
  };
  EXPECT_THAT(again([] {}), testing::Not(HasSubstr("lost")));
  for (const std::uintmax_t bytes : {std::uintmax_t{0}, size / 2}) {
    const std::string said = again([&] { fs::resize_file(best, bytes); });
    EXPECT_THAT(said, HasSubstr(best.string()));
    EXPECT_THAT(said, HasSubstr("the best weights up to step 20 are lost"));
    EXPECT_EQ(fs::file_size(best.string() + ".damaged"), bytes) << "set aside, not deleted";
    EXPECT_EQ(read_history(given).legs.at(0).steps, 20) << "the last step's, whole";
  }
  EXPECT_THAT(again([&] { fs::remove(best); }), HasSubstr("the best weights up to step 20 are lost"));
}

// provenance.json says how a run was made, and is no reason to stop one.
TEST_F(TrainingRun, ADamagedProvenanceIsWrittenAnew) {
  const std::vector<std::string> settings{"train.steps=4", "log.validate_every=0", "log.checkpoint_every=2"};
  const fs::path run_folder = run("runs", settings).folder, record = run_folder / "provenance.json";
  for (const std::uintmax_t bytes : {std::uintmax_t{0}, fs::file_size(record) / 2}) {
    fs::remove(run_folder / "DONE");
    fs::resize_file(record, bytes);
    run("runs", settings);
    EXPECT_THAT(text_of(run_folder / "log.txt"), HasSubstr(record.string()));
    EXPECT_EQ(read_provenance(record).seeds.at("run.seed"), 1);
  }
}

// The encoder's own rate holds after a break as it did before.
TEST_F(TrainingRun, TheEncodersOwnRateGoesOnInTheSameBits) {
  const std::vector<std::string> settings{"train.steps=8", "log.validate_every=0", "log.checkpoint_every=4"};
  const auto last_of = [](const TrainingOutcome& outcome) {
    auto tensors = read_safetensors(outcome.folder / "checkpoints/step-00000008.safetensors").tensors;
    tensors.erase("training.progress");  // holds the time it took
    return tensors;
  };
  std::vector<std::string> slower = settings;
  slower.push_back("train.encoder_rate=0.25");
  const TrainingOutcome whole = run("runs", slower);
  const auto unbroken = last_of(whole), alike = last_of(run("alike", settings));
  const std::string of_encoder = "encoder.features.conv0.weight";
  EXPECT_NE(unbroken.at(of_encoder).values, alike.at(of_encoder).values) << "the rate is no other";

  fs::remove(whole.folder / "DONE"), fs::remove(whole.folder / "checkpoints/step-00000008.safetensors");
  const TrainingOutcome resumed = run("runs", slower);
  EXPECT_THAT(text_of(resumed.folder / "log.txt"), HasSubstr("goes on after step 4 "));
  const auto found = last_of(resumed);
  ASSERT_EQ(found.size(), unbroken.size());
  for (const auto& [name, tensor] : unbroken) EXPECT_EQ(found.at(name).values, tensor.values) << name;
}

// What a run began with stays in its record, and others of that name are not taken for it: neither when it goes on nor
// when it has ended.
TEST_F(TrainingRun, WeightsThatItBeganWithAreRecordedAndOthersRefused) {
  const fs::path init = folder / "init.safetensors", first = run("first", {"train.steps=3"}).weights,
                 other = run("other", {"train.steps=3", "run.seed=3"}).weights;
  fs::copy_file(first, init);
  const std::vector<std::string> words{"train.steps=4", "log.checkpoint_every=2", "model.init=" + init.string()};
  const TrainingOutcome whole = run("whole", words);
  const std::string started = read_provenance(whole.folder / "provenance.json").started;
  const auto begun = [&] { return read_provenance(whole.folder / "provenance.json").inputs; };
  ASSERT_EQ(begun().size(), 1u);

  fs::remove(whole.folder / "DONE"), fs::remove(whole.folder / "checkpoints/step-00000004.safetensors");
  fs::copy_file(other, init, fs::copy_options::overwrite_existing);
  const auto refusal = [&] { return message_of([&] { run("whole", words); }, ErrorKind::Usage); };
  const auto tells = testing::AllOf(HasSubstr("began with other weights"), HasSubstr(init.string()),
                                    HasSubstr("hash " + record_file(first).hash), HasSubstr("run.variant"));
  EXPECT_THAT(refusal(), tells);
  fs::copy_file(first, init, fs::copy_options::overwrite_existing);
  run("whole", words);
  ASSERT_EQ(begun().size(), 1u) << "a run that went on";
  EXPECT_EQ(begun()[0].hash, record_file(first).hash);
  EXPECT_EQ(read_provenance(whole.folder / "provenance.json").started, started);

  fs::copy_file(other, init, fs::copy_options::overwrite_existing);
  EXPECT_THAT(refusal(), tells);
  fs::remove(init);
  EXPECT_TRUE(run("whole", words).skipped);
}

TEST_F(TrainingRun, OtherViewsThanItBeganWithAreRefused) {
  const std::vector<std::string> settings{"train.steps=6", "log.checkpoint_every=2", "log.validate_every=0"};
  const TrainingOutcome outcome = run("runs", settings);
  fs::remove(outcome.folder / "DONE");
  write_synthetic_rooms(folder / "data", "train", 2, 5, 32, 32, 5);
  EXPECT_THAT(message_of([&] { run("runs", settings); }, ErrorKind::Usage), HasSubstr("training views"));
}

}  // namespace
}  // namespace clerestory
