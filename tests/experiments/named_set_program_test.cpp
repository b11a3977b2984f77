// `clerestory generate --manifest` and `data check --manifest`: what is written, made, judged and refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tracer/named_set.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kSet = R"(# Two small rooms.
name = "pair"
version = 1
[views]
count = 1
width = 32
height = 24
spp = 2
clamp = 1.0
roll = 0.0
close_ups = 0.0
[light]
wanted = false
spp = 1
probes = 0
[train]
rooms = 2
seed = 3
setting = "training"
[test]
rooms = 1
seed = 3
setting = "held_out"
)";

struct NamedSetProgram : testing::Test {
  ScratchFolder folder{"clerestory-named-set-program"};
  fs::path manifest = folder / "pair.toml", set = folder / "set", log = folder / "log.txt";

  void SetUp() override { write_file(manifest, kSet); }
  int run(std::vector<std::string> words) const { return Program(words, log).wait(); }
  int generate(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> line{"generate", "--manifest", manifest.string(), "--out", set.string()};
    line.insert(line.end(), more.begin(), more.end());
    return run(line);
  }
  int check() const { return run({"data", "check", set.string(), "--manifest", manifest.string()}); }
  std::string said() const { return text_of(log); }
  void replace(const std::string& right, const std::string& wrong) const {
    std::string text = read_file(manifest);
    const std::size_t at = text.find(right);
    ASSERT_NE(at, std::string::npos) << right;
    write_file(manifest, text.replace(at, right.size(), wrong));
  }
};

TEST_F(NamedSetProgram, IsWrittenMadeAndJudged) {
  EXPECT_EQ(generate(), 2);
  EXPECT_THAT(said(), HasSubstr("expected.version is missing"));
  ASSERT_EQ(generate({"--write-expected"}), 0) << said();
  const std::string written = read_file(manifest);
  EXPECT_THAT(written, AllOf(testing::StartsWith("# Two small rooms.\n"), HasSubstr("[train.expected]")));
  EXPECT_EQ(generate({"--write-expected"}), 2);
  EXPECT_THAT(said(), AllOf(HasSubstr("pair.toml"), HasSubstr("version 1"), HasSubstr("a higher version")));
  EXPECT_EQ(read_file(manifest), written);

  fs::remove_all(set);
  ASSERT_EQ(generate({"--rooms", "1"}), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("32x24: train 1 rooms, 1 pairs of picture and maps; test 1 rooms"),
                            HasSubstr("as far as it was made")));
  EXPECT_EQ(check(), 2);
  EXPECT_THAT(said(), HasSubstr("train.txt: room room-s3-00001 is missing"));
  ASSERT_EQ(generate(), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("version 1, whole"), HasSubstr("1 views made, 2 were there")));
  EXPECT_EQ(check(), 0) << said();

  const fs::path depth = view_file(set / "train/room-s3-00001", "000", "depth");
  Image changed = read_map(depth, 1);
  for (float& v : changed.data) v *= 1.1f;
  write_exr(depth, changed, ExrType::Float);
  EXPECT_EQ(check(), 2);
  EXPECT_THAT(said(), HasSubstr(depth.string() + ": the mean of depth is"));
  EXPECT_EQ(generate(), 1) << "made, but not the set";
  EXPECT_THAT(said(), AllOf(HasSubstr(depth.string()), HasSubstr("what came out is not the set of the manifest")));
  EXPECT_EQ(run({"data", "check", set.string(), set.string(), "--manifest", manifest.string()}), 2);
  EXPECT_THAT(said(), AllOf(HasSubstr("--manifest"), HasSubstr("one DIR")));
}

TEST_F(NamedSetProgram, WhatTheManifestFixesIsRefused) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"--spp", "4"}, {"--seed=1"}, {"--size", "64x48"}, {"--no-light"}, {"--list", "a"}, {"--sheet", "a.png"}}) {
    EXPECT_EQ(generate(words), 2);
    EXPECT_THAT(said(),
                AllOf(HasSubstr(words[0].substr(0, words[0].find('='))), HasSubstr("the manifest fixes the set")));
  }
  EXPECT_EQ(generate({"--write-expected", "--rooms", "1"}), 2);
  EXPECT_THAT(said(), HasSubstr("--rooms"));
  EXPECT_EQ(run({"generate", "--out", set.string(), "--write-expected"}), 2);
  EXPECT_THAT(said(), AllOf(HasSubstr("--write-expected"), HasSubstr("--manifest FILE")));
  EXPECT_FALSE(fs::exists(set));
}

TEST_F(NamedSetProgram, AnotherVersionDoesNotWriteOverTheFirst) {
  ASSERT_EQ(generate({"--write-expected"}), 0) << said();
  const std::string rooms = read_file(set / "train.rooms");
  write_file(manifest, std::string(kSet));
  replace("version = 1", "version = 2"), replace("seed = 3", "seed = 4");
  const std::string begun = read_file(manifest);
  EXPECT_EQ(generate({"--write-expected"}), 2);
  EXPECT_THAT(said(), AllOf(HasSubstr("train.rooms"), HasSubstr("holds other rooms")));
  EXPECT_EQ(read_file(set / "train.rooms"), rooms);
  EXPECT_EQ(read_file(manifest), begun);
}

// As another rule, or another compiler, would make them.
TEST_F(NamedSetProgram, OtherRoomsAndAssetsAreRefusedBeforeTheWork) {
  ASSERT_EQ(generate({"--write-expected"}), 0) << said();
  const Manifest right = read_manifest(manifest);
  const std::string hash = right.splits[0].rooms_hash;
  replace("seed = 3\nsetting = \"training\"", "seed = 4\nsetting = \"training\"");
  fs::remove_all(set);
  EXPECT_EQ(generate(), 2);
  EXPECT_THAT(said(), AllOf(HasSubstr("pair.toml: train"), HasSubstr("other rooms"), HasSubstr(hash)));
  EXPECT_FALSE(fs::exists(set / "train"));
  replace(right.assets_hash, "0123456789abcdef");
  EXPECT_EQ(generate(), 2);
  EXPECT_THAT(said(),
              AllOf(HasSubstr("panoramas and models"), HasSubstr(right.assets_hash), HasSubstr("0123456789abcdef")));
}

// What the rules make changes; a set that cannot be made any more needs a new version:
// clerestory generate --manifest experiments/rooms/rooms_1100.toml --out DIR --write-expected
TEST(NamedSetProgramOfTheHouse, CanBeMade) {
  const fs::path file = fs::path(CLERESTORY_SOURCE_DIR) / "experiments/rooms/rooms_1100.toml";
  const Manifest manifest = read_manifest(file);
  EXPECT_EQ(manifest.assets_hash, hash_of_assets(fs::path(CLERESTORY_SOURCE_DIR) / "assets"));
  ASSERT_EQ(manifest.splits.size(), 2u);
  EXPECT_EQ(manifest.splits[0].rooms, 1000);
  EXPECT_EQ(manifest.splits[1].rooms, 100);
  EXPECT_EQ(manifest.splits[1].setting, Setting::HeldOut);
  for (const SetSplit& split : manifest.splits) {
    const RoomAssets assets = load_assets(default_assets(), split.setting);
    EXPECT_EQ(hash_of(make_rooms(manifest, split, assets)), split.rooms_hash) << split.name;
  }
}

}  // namespace
}  // namespace clerestory
