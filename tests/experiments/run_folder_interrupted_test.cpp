// Work on a run folder that is interrupted leaves nothing, and needs neither a terminal nor a reader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/experiments/program.hpp"
#include "tests/experiments/run_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

struct RunFolderInterrupted : RunFolder, testing::WithParamInterface<int> {
  /// Starts work that takes minutes, sends the signal once rays are traced; nothing that was there has changed and
  /// nothing is left.
  void stop(Words words) const {
    words.insert(words.end(), {"--spp", "100000"});
    put(said_, "");
    const std::vector<std::string> before = files_below(folder_.path());
    Program program(words, said_);
    ASSERT_TRUE(wait_until([&] { return said().find("chunks of rays") != std::string::npos; })) << said();
    program.signal(GetParam());
    EXPECT_EQ(program.wait(), kInterrupted) << said();
    EXPECT_THAT(said(), HasSubstr("interrupted"));
    EXPECT_THAT(said(), Not(HasSubstr("goes on from here"))) << "it begins again";
    EXPECT_EQ(files_below(folder_.path()), before) << words[0];
  }
  static Words without_spp(Words words) {
    const auto spp = std::ranges::find(words, "--spp");
    words.erase(spp, spp + 2);
    return words;
  }
};

TEST_P(RunFolderInterrupted, LeavesNothingAndEndsWithFour) {
  stop(without_spp(taken_apart(photo(), run())));
  stop(without_spp(inserted()));
  stop(without_spp(inserted({"--out", run()})));
  stop(without_spp(edited()));
}

// LLVM, which builds kernels in the process, deletes the files of a build on a signal that reaches it.
TEST_P(RunFolderInterrupted, WhileKernelsAreBuilt) {
  const fs::path cache = folder_ / "kernels";
  fs::create_directory(cache);
  Program program(taken_apart(photo(), folder_ / "new"), said_, {{}, {{"POCL_CACHE_DIR", cache}}});
  ASSERT_TRUE(wait_until([&] {
    return std::ranges::any_of(files_below(cache), [](const std::string& f) { return f.ends_with(".tmp"); });
  }));
  program.signal(GetParam());
  EXPECT_EQ(program.wait(), kInterrupted) << said();
  EXPECT_FALSE(fs::exists(folder_ / "new") || fs::exists(folder_ / ".new.lock") ||
               fs::exists(folder_ / ".new.partial"));
}

// Wherever it is lost, from the first launch on until work ends before that.
TEST_F(RunFolder, ALostDeviceEndsWithThreeAndLeavesNothing) {
  put(said_, "");
  const std::vector<std::string> before = files_below(folder_.path());
  int lost = 0;
  for (int launches = 0;; launches = 2 * launches + 1, ++lost) {
    const std::string less = "lost_after=" + std::to_string(launches);
    const int code = start(taken_apart(photo(), folder_ / "new"), {{}, {{"CLERESTORY_PRETEND", less}}});
    if (code == 0) break;
    ASSERT_EQ(code, 3) << less << ": " << said();
    EXPECT_THAT(said(), HasSubstr("CL_DEVICE_NOT_AVAILABLE"));
    EXPECT_EQ(files_below(folder_.path()), before) << less;
  }
  EXPECT_GT(lost, 3);
  EXPECT_TRUE(fs::exists(folder_ / "new/rerender.exr"));
}

// What nohup starts goes on when its terminal is gone, and so does what writes to a reader that left.
TEST_F(RunFolder, NoTerminalAndNoReaderAreNeeded) {
  std::string command = "trap '' HUP; { ";
  for (const std::string& word : Words{CLERESTORY_PROGRAM, "invert", photo(), "--gbuffer", view_, "--light", "image",
                                       "--spp", "2", "--out", folder_ / "new"})
    command += "'" + word + "' ";
  EXPECT_EQ(std::system((command + "2>&1 & pid=$!; sleep 0.2; kill -HUP $pid; wait $pid; } | true").c_str()), 0);
  EXPECT_TRUE(fs::exists(folder_ / "new/rerender.exr"));
  EXPECT_FALSE(fs::exists(folder_ / ".new.partial"));
}

INSTANTIATE_TEST_SUITE_P(Signals, RunFolderInterrupted, testing::Values(SIGINT, SIGTERM, SIGHUP));

}  // namespace
}  // namespace clerestory
