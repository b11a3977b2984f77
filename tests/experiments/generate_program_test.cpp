// `clerestory generate`, killed (kill -9) at several points of its work and run again each time, or shared out to
// several devices at once, leaves what one unbroken run leaves: the same files with the same bits, and no other.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>

#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

long pictures(const std::vector<std::string>& files) {
  return std::ranges::count_if(files, [](const std::string& f) { return f.ends_with("_im.exr"); });
}

struct GenerateProgram : testing::Test {
  ScratchFolder folder{"clerestory-generate-program"};

  // Many views: a busy machine that looks late still kills in the middle.
  Program start(const std::string& out, const std::vector<std::string>& more = {}, const std::string& log = {},
                const Surroundings& around = {}) const {
    const std::string assets = std::string(CLERESTORY_SOURCE_DIR) + "/assets";
    std::vector<std::string> line{"generate", "--rooms", "2", "--views", "10", "--size", "20x16", "--spp", "4"};
    for (const char* word : {"--light-spp", "1", "--probes", "1", "--seed", "5", "--balls", "--assets"}) {
      line.push_back(word);
    }
    line.insert(line.end(), {assets, "--out", (folder / out).string()});
    line.insert(line.end(), more.begin(), more.end());
    return Program(line, folder / ((log.empty() ? out : log) + ".txt"), around);
  }
  std::string said(const std::string& out) const { return text_of(folder / (out + ".txt")); }

  /// Runs until a file below `out` satisfies `seen`, then kills.
  void kill_when(const std::string& out, const std::function<bool(const std::string& file)>& seen) const {
    Program program = start(out);
    EXPECT_TRUE(wait_until([&] { return std::ranges::any_of(files_below(folder / out), seen); })) << said(out);
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait(), 128 + SIGKILL) << "it was done before it was killed: " << said(out);
  }

  void expect_whole(const std::string& out) const {
    const std::vector<std::string> files = files_below(folder / "whole");
    EXPECT_EQ(pictures(files), 20);
    ASSERT_EQ(files_below(folder / out), files);
    for (const std::string& file : files)
      EXPECT_TRUE(text_of(folder.path() / out / file) == text_of(folder.path() / "whole" / file)) << file << " differs";
  }
};

TEST_F(GenerateProgram, KilledEndsInTheSameBits) {
  Program whole = start("whole");
  ASSERT_EQ(whole.wait(), 0) << said("whole");

  // Before any view is whole, in the first room's middle (files of a view, but not yet its picture, which comes last),
  // at the writing of a file if one is caught at it, and in the second room.
  kill_when("broken", [](const std::string& f) { return f.ends_with("_variance.exr"); });
  kill_when("broken", [](const std::string& f) { return f.ends_with("003_camera.json"); });
  kill_when("broken", [](const std::string& f) { return f.ends_with(".tmp") || f.ends_with("006_im.exr"); });
  kill_when("broken", [](const std::string& f) { return f.ends_with("00001/001_depth.exr"); });
  const long made = pictures(files_below(folder / "broken"));
  ASSERT_GE(made, 10) << "the first room";
  ASSERT_LT(made, 20) << "it was killed after all was done";

  Program last = start("broken");
  ASSERT_EQ(last.wait(), 0) << said("broken");
  expect_whole("broken");
}

TEST_F(GenerateProgram, AListThatWasChangedIsNotWrittenAnew) {
  const std::vector<std::string> fewer{"--views", "1", "--no-light", "--split", "train"};
  const auto ends = [&](std::vector<std::string> more, int code, const std::string& because) {
    std::vector<std::string> line{"generate", "--size", "20x16", "--spp", "1", "--box-rooms", "--out", folder / "own"};
    line.insert(line.end(), fewer.begin(), fewer.end()), line.insert(line.end(), more.begin(), more.end());
    EXPECT_EQ(Program(line, folder / "own.txt").wait(), code) << said("own");
    EXPECT_NE(said("own").find(because), std::string::npos) << said("own");
  };
  ends({"--rooms", "3"}, 0, "");
  ends({"--rooms", "2"}, 0, "");  // the same for fewer, and for more
  ends({"--rooms", "4"}, 0, "");
  const std::string list = folder / "own/train.txt";
  const std::string whole = text_of(list), cut = whole.substr(whole.find('\n') + 1);
  std::ofstream(list) << cut;
  ends({"--rooms", "5"}, 2, "train.txt:1: the list was changed");
  EXPECT_EQ(text_of(list), cut);
  std::ofstream(list) << whole;
  std::ofstream(folder / "own/val.txt") << whole;
  ends({"--rooms", "5"}, 2, "val.txt:1: the list was changed");
  EXPECT_EQ(text_of(folder / "own/val.txt"), whole);
  ends({"--rooms", "5", "--shard", "0/2", "--sheet", folder / "sheet.png"}, 2, "--sheet: does not go with --shard");
  ends({"--write-rooms", folder / "own.rooms"}, 2, "does not go with --write-rooms");
  ends({"--rooms", "5", "--probes", "2"}, 2, "--probes: does not go with --no-light");
}

// Two of PoCL's, which share the cores: a program each, at the same time, into one folder.
TEST_F(GenerateProgram, SeveralDevicesAtOnceMakeTheSame) {
  Program whole = start("whole");
  ASSERT_EQ(whole.wait(), 0) << said("whole");
  const Surroundings two{{}, {{"POCL_DEVICES", "pthread pthread"}}};
  Program first = start("parts", {"--device", "0", "--shard", "0/2"}, "first", two),
          second = start("parts", {"--device", "1", "--shard", "1/2"}, "second", two);
  EXPECT_EQ(first.wait(), 0) << said("first");
  EXPECT_EQ(second.wait(), 0) << said("second");
  expect_whole("parts");
}

}  // namespace
}  // namespace clerestory
