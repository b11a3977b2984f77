// Weights of the light: the text of their shape, the two files and every way in which they may be wrong, the card.

#include "experiments/applications/light_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "experiments/training/checkpoint.hpp"
#include "experiments/training/report.hpp"
#include "experiments/truth/study_light.hpp"
#include "experiments/weights/light_text.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/io/safetensors.hpp"
#include "nets/constant_light.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

std::string usage_message(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Usage) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

TEST(StudyLights, SayWhatIsFittedAndHowItIsWeighed) {
  EXPECT_EQ(study_light("net").light, "net");
  EXPECT_EQ(study_light("net").fitted, "");
  EXPECT_EQ(study_light("image+lamps").fitted, "lamps");
  EXPECT_EQ(study_light("image+lamps").fit.floor, RenderSettings().fit.floor);
  EXPECT_EQ(study_light("constant+fit").fit.floor, kConstantFit.floor);
  for (const char* name : {"image+fit", "panorama+fit", "mirrored+fit"}) EXPECT_EQ(study_light(name).fitted, "fit");
  EXPECT_EQ(light_label("net+lamps 0.5,1", "Ours"), "Ours: learned light, lamps fitted 0.5,1");
  EXPECT_EQ(light_label("constant+fit", "Ours"), "one constant, fitted as lamps are");
  EXPECT_THAT(usage_message([] { light_label("moon", "Ours"); }), HasSubstr("moon"));
  for (const std::string& light : light_names())
    EXPECT_EQ(light_label(light, "Ours").starts_with("Ours: "), is_learned_light(light)) << light;
  const StudyLight weighted = study_light("constant+fit 0.25,3");
  EXPECT_EQ(weighted.light, "constant");
  EXPECT_EQ(weighted.fitted, "fit");
  EXPECT_EQ(weighted.fit.floor, 0.25);
  EXPECT_EQ(weighted.fit.ridge, 3);
  for (const char* name : {"net+fit", "net+", "net+lamp", "net+lamps 1", "net+lamps 1,2,3", "net+lamps 0,1",
                           "net+lamps 1,-1", "net+lamps nan,1", "net+lamps x,1"})
    EXPECT_THAT(usage_message([&] { study_light(name); }), HasSubstr(name));
}

/// As small as the nets come.
LightSizes tiny() {
  LightSizes s = light_sizes("compact");
  s.in_view.trunk.blocks = s.out_of_view.trunk.blocks = {1, 1, 1, 1};
  s.in_view.trunk.channels = s.out_of_view.trunk.channels = {16, 16, 16, 16};
  s.in_view.frequencies = 4, s.in_view.width = 16, s.in_view.layers = 2, s.in_view.again = 1;
  s.out_of_view.stem = 16, s.out_of_view.hidden = {16, 8};
  s.out_of_view.shells.channels = {16, 16, 16, 16}, s.out_of_view.shells.code = 16;
  return s;
}

TEST(LightText, EveryFieldSurvives) {
  const std::vector<std::function<void(LightSizes&)>> changes{
      [](LightSizes& s) { s.in_view.trunk.blocks[1] = 9; },
      [](LightSizes& s) { s.in_view.trunk.channels[3] = 48; },
      [](LightSizes& s) { s.in_view.trunk.stages = 2; },
      [](LightSizes& s) { s.in_view.trunk.imagenet_input = true; },
      [](LightSizes& s) { s.in_view.frequencies = 13; },
      [](LightSizes& s) { s.in_view.direction_deviation = 0.1 + 0.2; },
      [](LightSizes& s) { s.in_view.surface_deviation = 1.0 / 3; },
      [](LightSizes& s) { s.in_view.width = 17; },
      [](LightSizes& s) { s.in_view.layers = 11; },
      [](LightSizes& s) { s.in_view.again = 1; },
      [](LightSizes& s) { s.in_view.output = LightOutput::Exp; },
      [](LightSizes& s) { s.in_view.log_input = !s.in_view.log_input; },
      [](LightSizes& s) { s.out_of_view.form = OutOfViewForm::Shells; },
      [](LightSizes& s) { s.out_of_view.trunk.blocks[0] = 9; },
      [](LightSizes& s) { s.out_of_view.trunk.channels[0] = 80; },
      [](LightSizes& s) { s.out_of_view.trunk.stages = 1; },
      [](LightSizes& s) { s.out_of_view.trunk.imagenet_input = true; },
      [](LightSizes& s) { s.out_of_view.hyper = HyperNet::LowRank; },
      [](LightSizes& s) { s.out_of_view.stem = 19; },
      [](LightSizes& s) { s.out_of_view.inner = 23; },
      [](LightSizes& s) { s.out_of_view.rank = 3; },
      [](LightSizes& s) { s.out_of_view.octaves = 0; },
      [](LightSizes& s) { s.out_of_view.hidden = {5}; },
      [](LightSizes& s) { s.out_of_view.march.segments = 7; },
      [](LightSizes& s) { s.out_of_view.march.near = 0.07; },
      [](LightSizes& s) { s.out_of_view.march.radius = 3.3; },
      [](LightSizes& s) { s.out_of_view.march.jitter = !s.out_of_view.march.jitter; },
      [](LightSizes& s) { s.out_of_view.released_output = !s.out_of_view.released_output; },
      [](LightSizes& s) { s.out_of_view.log_input = !s.out_of_view.log_input; },
      [](LightSizes& s) { s.out_of_view.sees_maps = !s.out_of_view.sees_maps; },
      [](LightSizes& s) { s.out_of_view.background = !s.out_of_view.background; },
      [](LightSizes& s) { s.out_of_view.shells.count = 6; },
      [](LightSizes& s) { s.out_of_view.shells.first = 0.3; },
      [](LightSizes& s) { s.out_of_view.shells.last = 2.9; },
      [](LightSizes& s) { s.out_of_view.shells.rows = 40; },
      [](LightSizes& s) { s.out_of_view.shells.columns = 80; },
      [](LightSizes& s) {
        s.out_of_view.shells.channels = {32, 48};
      },
      [](LightSizes& s) { s.out_of_view.shells.code = 29; },
      [](LightSizes& s) { s.delta = DeltaDepth::Window; }};
  const LightSizes paper = light_sizes("paper");
  const std::string original = light_text(paper);
  LightSizes all = paper;
  std::size_t fields = 0;
  for (const char c : original) fields += c == '=';
  EXPECT_EQ(fields, changes.size()) << "a field that is not tried here";
  for (std::size_t i = 0; i < changes.size(); ++i) {
    LightSizes changed = paper;
    changes[i](changed), changes[i](all);
    const std::string text = light_text(changed);
    EXPECT_NE(text, original) << "change " << i << " cannot be told";
    EXPECT_EQ(light_text(light_from_text(text, "test")), text);
  }
  const LightSizes back = light_from_text(light_text(all), "test");
  EXPECT_EQ(light_text(back), light_text(all));
  EXPECT_EQ(back.in_view.trunk.channels, all.in_view.trunk.channels);
  EXPECT_EQ(back.in_view.direction_deviation, all.in_view.direction_deviation);  // to the bit
  EXPECT_EQ(back.in_view.output, LightOutput::Exp);
  EXPECT_EQ(back.out_of_view.hidden, std::vector<int>{5});
  EXPECT_EQ(back.out_of_view.march.jitter, all.out_of_view.march.jitter);
  EXPECT_EQ(back.out_of_view.shells.channels, all.out_of_view.shells.channels);
}

TEST(LightText, OlderThanAField) {
  const LightSizes read = light_from_text("in_view.width=24", "old.safetensors");
  EXPECT_EQ(read.in_view.width, 24);
  EXPECT_EQ(read.out_of_view.form, OutOfViewForm::Field);
  EXPECT_EQ(read.out_of_view.stem, OutOfViewSize{}.stem);
  EXPECT_EQ(read.delta, DeltaDepth::Linear);
}

TEST(LightText, WhatMakesNoSenseIsNamed) {
  const auto refused = [](const std::string& text) {
    const std::string said = usage_message([&] { light_from_text(text, "file.safetensors"); });
    EXPECT_THAT(said, HasSubstr("file.safetensors: net"));
    return said;
  };
  for (const char* text : {"", "growth 16, 32 first channels", "in_view.width=3 in_view.width=3"})
    EXPECT_THAT(refused(text), HasSubstr("cannot be read")) << text;
  EXPECT_THAT(refused("in_view.widht=3"), HasSubstr("in_view.widht"));
  for (const char* pair :
       {"in_view.width=0", "in_view.width=5000", "in_view.width=", "in_view.width=3x", "in_view.blocks=3-4-6",
        "in_view.blocks=3-4-6-", "in_view.output=bright", "in_view.log_input=1", "out_of_view.radius=nan",
        "out_of_view.radius=1e4", "out_of_view.hidden=", "out_of_view.hidden=8--8", "out_of_view.hidden=-8"})
    EXPECT_THAT(refused(pair), HasSubstr(std::string(pair).substr(0, std::string(pair).find('=')))) << pair;
  EXPECT_THAT(refused("in_view.layers=4 in_view.again=4"), HasSubstr("again"));
  EXPECT_THAT(refused("out_of_view.form=shells out_of_view.stages=0"), HasSubstr("out_of_view.stages"));
  EXPECT_NO_THROW(light_from_text("out_of_view.form=field out_of_view.stages=0", "file.safetensors"));
}

/// States of tiny nets, a history and what `weights export` would write of them.
struct LightWeights : testing::Test {
  ScratchFolder folder{"clerestory-light-weights"};
  States states{Device::open()};
  const LightSizes sizes = tiny();
  History history;
  const std::string local = (folder / "out/light_local.safetensors").string(),
                    global = (folder / "out/light_global.safetensors").string();

  void SetUp() override {
    unsigned bits = 1;
    for (const auto& [name, shape] : light_states(sizes)) {
      Tensor tensor(shape);
      for (double& v : tensor.real)
        v = static_cast<double>((bits = bits * 1664525u + 1013904223u) >> 8) * 0x1p-24 - 0.5;
      states.set(name, tensor);
    }
    Leg leg;
    leg.kind = "light", leg.experiment = "train", leg.variant = "light", leg.commit = "0123456789ab";
    leg.started = "2026-01-01T00:00:00Z", leg.preset = "compact", leg.width = 40, leg.height = 30, leg.seed = 3;
    leg.hours = 0.5, leg.views_seen = 70;
    for (const double hours : {0.0, 0.5})
      leg.curve.push_back({10, hours, 0.9 - hours / 2, std::vector<double>(6, 0.3), std::vector<double>(6, 0.7), 0});
    history.legs = {leg};
    fs::create_directories(folder / "out");
    write_light(folder / "out", states, history, facts());
  }
  WeightsFacts facts() const { return {"compact", light_text(sizes), {40, 30}, "0123456789ab", light_states(sizes)}; }
  std::string load_message(const fs::path& path) const {
    return usage_message([&] { load_light(path, Device::open()); });
  }
  /// Changes one part and says what loading the folder says then.
  std::string with(const std::string& path, const std::function<void(TensorFile&)>& change) const {
    const TensorFile whole = read_safetensors(path);
    TensorFile changed = whole;
    change(changed);
    write_safetensors(path, changed, FloatStorage::F16);
    const std::string said = load_message(folder / "out");
    write_safetensors(path, whole, FloatStorage::F16);
    EXPECT_THAT(said, HasSubstr(path));
    return said;
  }
};

TEST_F(LightWeights, TwoFilesHoldTheStatesInHalfAndSayWhatTheyAre) {
  std::size_t tensors = 0;
  for (const auto& [path, part] : {std::pair{local, "local"}, {global, "global"}}) {
    const TensorFile file = read_safetensors(path);
    tensors += file.tensors.size();
    for (const auto& [name, tensor] : file.tensors) EXPECT_TRUE(name.starts_with(std::string(part) + ".")) << name;
    for (const auto& [key, value] : std::map<std::string, std::string>{{"kind", "light"},
                                                                       {"part", part},
                                                                       {"preset", "compact"},
                                                                       {"net", light_text(sizes)},
                                                                       {"width", "40"},
                                                                       {"height", "30"},
                                                                       {"longer_side", "40"},
                                                                       {"views_seen", "70"},
                                                                       {"score", "0.65"},
                                                                       {"error.misses_log", "0.3"},
                                                                       {"commit", "0123456789ab"}})
      EXPECT_EQ(file.metadata.at(key), value) << key;
  }
  const LoadedLight loaded = load_light(folder / "out", Device::open());
  EXPECT_EQ(light_text(loaded.net), light_text(sizes));
  EXPECT_EQ(loaded.preset, "compact");
  EXPECT_EQ(loaded.longer_side(), 40);
  EXPECT_EQ(loaded.history.legs.at(0).curve.size(), 2u);
  const auto wanted = light_states(sizes);
  EXPECT_EQ(tensors, wanted.size());
  for (const auto& [name, shape] : wanted) {
    const Tensor read = loaded.states->get(name), written = states.get(name);
    ASSERT_EQ(read.shape, shape) << name;
    // half an ulp of half precision, values below 0.5
    for (std::size_t i = 0; i < read.real.size(); ++i) ASSERT_NEAR(read.real[i], written.real[i], 0x1p-13) << name;
  }
}

TEST_F(LightWeights, AGainTravelsWithThem) {
  const fs::path out = folder / "out", said = folder / "said.txt";
  EXPECT_EQ(load_light(out, Device::open()).net.out_of_view.gain, 1);
  const auto exported = [&](const fs::path& from, const fs::path& to, const std::string& gain) {
    return Program({"weights", "export", from, to, "--gain", gain}, said).wait();
  };
  ASSERT_EQ(exported(out, out, "1.6"), 0) << text_of(said);  // in its place
  EXPECT_EQ(load_light(out, Device::open()).net.out_of_view.gain, 1.6);
  EXPECT_EQ(read_light_sizes(out).out_of_view.gain, 1.6);
  EXPECT_THAT(text_of(out / "CARD.md"), HasSubstr("| gain out of view | 1.6, chosen after training"));
  ASSERT_EQ(Program({"weights", "export", out, folder / "again"}, said).wait(), 0) << text_of(said);
  EXPECT_EQ(read_light_sizes(folder / "again").out_of_view.gain, 1.6) << "it is kept";
  States fresh(Device::open());  // a leg goes on from them whatever the gain, and its own weights have none
  read_initial_weights(out, fresh, light_text(sizes), light_states(sizes));

  for (const char* gain : {"0", "-1", "101", "nan", "much"}) {
    EXPECT_EQ(exported(out, folder / "refused", gain), 2) << gain;
    EXPECT_THAT(text_of(said), HasSubstr("--gain")) << gain;
  }
  EXPECT_FALSE(fs::exists(folder / "refused/light_local.safetensors"));
  const fs::path maps = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";
  EXPECT_EQ(exported(maps, folder / "maps.safetensors", "2"), 2);
  EXPECT_THAT(text_of(said), HasSubstr("--gain"));
  EXPECT_THAT(with(local, [](TensorFile& f) { f.metadata["gain"] = "bright"; }), HasSubstr("gain"));
  EXPECT_THAT(with(global, [](TensorFile& f) { f.metadata["gain"] = "2"; }), HasSubstr("do not belong together"));
  EXPECT_THAT(with(global, [](TensorFile& f) { f.metadata.erase("gain"); }), HasSubstr("do not belong together"));
}

TEST_F(LightWeights, ShippedPresetFits) {
  std::map<std::string, std::uint64_t> bytes;
  for (const auto& [name, shape] : light_states(light_sizes("compact")))
    bytes[name.substr(0, name.find('.'))] += 2 * static_cast<std::uint64_t>(shape.count());
  ASSERT_EQ(bytes.size(), 2u);
  for (const auto& [part, size] : bytes) EXPECT_LE(size, 20'000'000u) << part;
}

TEST_F(LightWeights, WrongFilesAreNamed) {
  EXPECT_THAT(with(local, [](TensorFile& f) { f.metadata.erase("kind"), f.metadata.erase("history"); }),
              HasSubstr("weights of the maps"));
  EXPECT_THAT(with(global, [](TensorFile& f) { f.metadata["part"] = "local"; }), HasSubstr("another part"));
  EXPECT_THAT(with(global, [](TensorFile& f) { f.metadata.erase("part"); }), HasSubstr("part"));
  EXPECT_THAT(with(local, [](TensorFile& f) { f.metadata.erase("net"); }), HasSubstr("net"));
  EXPECT_THAT(with(local, [](TensorFile& f) { f.metadata["net"] = "growth 16"; }), HasSubstr("cannot be read"));
  EXPECT_THAT(with(local, [](TensorFile& f) { f.metadata["history"] = "{"; }), HasSubstr("history"));
  EXPECT_THAT(with(global, [](TensorFile& f) { f.metadata["width"] = "80"; }), HasSubstr(local));

  LightSizes narrower = sizes;
  narrower.in_view.direction_deviation += 1;  // the same tensors, read otherwise
  EXPECT_THAT(with(global, [&](TensorFile& f) { f.metadata["net"] = light_text(narrower); }),
              HasSubstr("do not belong together"));
  History other = history;
  other.legs[0].hours = 0.6;
  EXPECT_THAT(with(global, [&](TensorFile& f) { f.metadata["history"] = history_json(other); }),
              HasSubstr("do not belong together"));

  for (const std::string& path : {local, global}) {
    const std::string victim = read_safetensors(path).tensors.rbegin()->first;
    EXPECT_THAT(with(path, [&](TensorFile& f) { f.tensors.erase(victim); }), HasSubstr(victim));
    EXPECT_THAT(with(path, [&](TensorFile& f) { f.tensors.at(victim).shape.push_back(1); }), HasSubstr(victim));
    fs::rename(path, path + ".away");
    EXPECT_THAT(load_message(folder / "out"), HasSubstr(path));
    fs::rename(path + ".away", path);
  }
  EXPECT_THAT(load_message(folder / "nowhere"), HasSubstr("nowhere"));
  EXPECT_THAT(load_message(local), HasSubstr("global.")) << "one part is no light";
  const fs::path maps = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";
  EXPECT_THAT(load_message(maps), HasSubstr("maps.safetensors: these are no weights of the light"));
  EXPECT_THAT(usage_message([&] { load_weights(local, Device::open()); }),
              HasSubstr(local + ": these are weights of the light"));
  load_light(folder / "out", Device::open());  // all is as it was
}

TEST_F(LightWeights, ALegStartsFromTheFolderOrTheCheckpoint) {
  const fs::path checkpoint = folder / "step.safetensors";
  TrainingProgress progress;
  progress.history = history;
  write_checkpoint(checkpoint, states, progress, {"compact", light_text(sizes), {40, 30}, 3, "hash", 1});
  for (const fs::path& start : {checkpoint, folder / "out"}) {
    States fresh(Device::open());
    EXPECT_EQ(read_initial_weights(start, fresh, light_text(sizes), light_states(sizes)).history.views_seen(), 70);
    for (const auto& [name, shape] : light_states(sizes))
      for (std::size_t i = 0; i < 4 && i < static_cast<std::size_t>(shape.count()); ++i)
        ASSERT_NEAR(fresh.get(name).real[i], states.get(name).real[i], 0x1p-13) << name;
    LightSizes wider = sizes;
    wider.in_view.width = 32;
    EXPECT_THAT(usage_message([&] { read_initial_weights(start, fresh, light_text(wider), light_states(wider)); }),
                HasSubstr(start.string() + ": weights of another net"));
  }
  fs::remove(global);
  States fresh(Device::open());
  EXPECT_THAT(
      usage_message([&] { read_initial_weights(folder / "out", fresh, light_text(sizes), light_states(sizes)); }),
      HasSubstr(global));
  EXPECT_EQ(weights_files(checkpoint), std::vector<fs::path>{checkpoint});
}

TEST_F(LightWeights, ProgramExportsAndInspects) {
  const fs::path checkpoint = folder / "step.safetensors", said = folder / "said.txt";
  TrainingProgress progress;
  progress.history = history;
  write_checkpoint(checkpoint, states, progress, {"compact", light_text(sizes), {40, 30}, 3, "hash", 1});
  const auto run = [&](std::vector<std::string> words) { return Program(words, said).wait(); };
  ASSERT_EQ(run({"weights", "export", checkpoint, folder / "exported"}), 0) << text_of(said);
  for (const char* file : {"light_local.safetensors", "light_global.safetensors"}) {
    EXPECT_THAT(text_of(said), HasSubstr(file));
    EXPECT_EQ(read_file(folder / "exported" / file), read_file(folder / "out" / file)) << file;
  }
  EXPECT_TRUE(fs::exists(folder / "exported/validation_light.svg"));
  ASSERT_EQ(run({"weights", "export", folder / "exported", folder / "again"}), 0) << text_of(said);
  EXPECT_EQ(read_file(folder / "again/light_local.safetensors"), read_file(local));
  ASSERT_EQ(run({"weights", "inspect", local}), 0);
  EXPECT_THAT(text_of(said), HasSubstr("part: local"));
  EXPECT_EQ(run({"weights", "export", checkpoint, folder / "light.safetensors"}), 2);
  EXPECT_THAT(text_of(said), HasSubstr("light.safetensors"));
}

TEST_F(LightWeights, ExportReplacesWeightsAndTheirCardAndNothingElse) {
  const fs::path checkpoint = folder / "step.safetensors", said = folder / "said.txt", out = folder / "kept";
  TrainingProgress progress;
  progress.history = history;
  write_checkpoint(checkpoint, states, progress, {"compact", light_text(sizes), {40, 30}, 3, "hash", 1});
  const auto exported = [&] { return Program({"weights", "export", checkpoint, out}, said).wait(); };
  fs::create_directories(out);
  for (const char* name : {"CARD.md", "validation_light.svg", "light_global.safetensors"}) {
    write_file(out / name, "mine");
    EXPECT_EQ(exported(), 2) << text_of(said);
    EXPECT_THAT(text_of(said), HasSubstr(name));
    EXPECT_EQ(files_below(out), std::vector<std::string>{name}) << "nothing is half done";
    EXPECT_EQ(read_file(out / name), "mine");
    fs::remove(out / name);
  }
  for (const char* name : {"light_local.safetensors", "maps.safetensors"}) {  // whose training nobody knows
    write_safetensors(out / name, TensorFile());
    const std::string before = read_file(out / name);
    EXPECT_EQ(exported(), 2) << text_of(said);
    EXPECT_THAT(text_of(said), HasSubstr(name));
    EXPECT_EQ(files_below(out), std::vector<std::string>{name}) << "nothing is half done";
    EXPECT_EQ(read_file(out / name), before);
    fs::remove(out / name);
  }
  EXPECT_EQ(exported(), 0) << text_of(said);
  EXPECT_EQ(exported(), 0) << "its own are replaced: " << text_of(said);
}

TEST_F(LightWeights, OneCardForAllThatLiesInAFolder) {
  const fs::path shipped = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";
  const fs::path maps = folder / "maps/maps.safetensors", both = folder / "out/maps.safetensors";
  const std::string light = text_of(write_folder_card(folder / "out", both));
  EXPECT_TRUE(light.starts_with("# Weights of the light\n")) << light;
  EXPECT_THAT(light, HasSubstr("light_local.safetensors, light_global.safetensors"));
  EXPECT_THAT(light, HasSubstr("](validation_light.svg)"));
  EXPECT_THAT(light, HasSubstr("rays that miss"));
  EXPECT_THAT(light, HasSubstr("view's best constant"));
  EXPECT_FALSE(fs::exists(folder / "out/validation.svg"));
  fs::create_directories(maps.parent_path());
  fs::copy(shipped, maps), fs::copy(shipped, both);
  const std::string map = text_of(write_folder_card(folder / "maps", maps));
  EXPECT_TRUE(map.starts_with("# Weights of the maps\n"));
  EXPECT_EQ(text_of(write_folder_card(folder / "out", both)), map + "\n" + light);
}

// The card beside the shipped weights is what `weights export` writes for them.
TEST_F(LightWeights, ShippedCardIsThatOfTheShippedFiles) {
  const fs::path shipped = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights";
  fs::create_directories(folder / "shipped");
  for (const auto& entry : fs::directory_iterator(shipped))
    if (entry.path().extension() == ".safetensors" || entry.path().extension() == ".json")
      fs::copy(entry.path(), folder / "shipped");
  EXPECT_EQ(text_of(write_folder_card(folder / "shipped", folder / "shipped/maps.safetensors")),
            text_of(shipped / "CARD.md"));
}

TEST(LightChoice, DirectionsAreDrawnTowardsLampsWhereThePhotographIsTheLight) {
  for (const auto& [light, sampler] : {std::pair{"image", "guided"}, {"net", "vndf_caps"}, {"constant", "vndf_caps"}}) {
    RenderSettings settings;
    settings.light = light;
    choose_sampler(settings);
    EXPECT_EQ(settings.sampler, sampler) << light;
  }
}

}  // namespace
}  // namespace clerestory
