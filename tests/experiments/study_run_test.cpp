// A study through the real program: done only with its report, with or without gnuplot, and it stops when told to.
#include "experiments/studies/study_run.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "host/io/image.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

struct StudyRunTest : testing::Test {
  ScratchFolder folder_{"clerestory-study-run"};
  fs::path said_ = folder_ / "said.txt";

  std::vector<std::string> words(const std::string& truth_spp = "64") const {
    return {"run",
            std::string(CLERESTORY_SOURCE_DIR) + "/experiments/configs/layer.toml",
            "run.root=" + folder_.path().string(),
            "data.rooms=1",
            "data.width=32",
            "data.height=24",
            "study.spp=[4,16]",
            "study.truth_spp=" + truth_spp,
            "study.seeds=2"};
  }
  int start(const Surroundings& around = {}) const { return Program(words(), said_, around).wait(); }
  std::string said() const { return text_of(said_); }
  fs::path run() const {
    for (const auto& entry : fs::directory_iterator(folder_ / "layer")) return entry.path();
    return {};
  }
};

TEST_F(StudyRunTest, IsDoneOnlyWithItsReport) {
  ASSERT_EQ(start(), 0) << said();
  EXPECT_THAT(text_of(run() / "report.html"), HasSubstr("done"));
  EXPECT_THAT(text_of(run() / "report.html"), Not(HasSubstr("not finished")));
  for (const std::string& here : {folder_.path().string(), std::string(CLERESTORY_SOURCE_DIR)})
    EXPECT_THAT(text_of(run() / "report.html"), Not(HasSubstr(here))) << "no folder of this computer";
  // As if it had been interrupted before its end; then the report cannot be written.
  fs::remove(run() / "DONE"), fs::remove(run() / "report.html");
  fs::create_directory(run() / "report.html");
  EXPECT_NE(start(), 0) << said();
  EXPECT_FALSE(fs::exists(run() / "DONE")) << "a study without a report is not done";
  fs::remove(run() / "report.html");
  EXPECT_EQ(start(), 0) << said();
  EXPECT_TRUE(fs::exists(run() / "DONE") && fs::is_regular_file(run() / "report.html"));
}

TEST_F(StudyRunTest, AKindThatIsNotRepeatedRefusesSeeds) {
  Program program({"run", std::string(CLERESTORY_SOURCE_DIR) + "/experiments/configs/edges.toml",
                   "run.root=" + folder_.path().string(), "study.seeds=9"},
                  said_);
  EXPECT_EQ(program.wait(), static_cast<int>(ErrorKind::Usage));
  EXPECT_THAT(said(), HasSubstr("is not repeated by it"));
}

TEST_F(StudyRunTest, WithoutGnuplotPlotsAreLeftOutAndSaid) {
  ASSERT_EQ(start({{}, {{"PATH", folder_.path()}}}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("gnuplot is not installed: plots are left out"));
  EXPECT_TRUE(fs::exists(run() / "DONE"));
  EXPECT_FALSE(fs::exists(run() / "artifacts" / "error_time.svg"));
  EXPECT_TRUE(fs::exists(run() / "artifacts" / "layer.table.json"));
  EXPECT_THAT(text_of(run() / "report.html"), HasSubstr("left out: gnuplot is not installed"));
}

TEST_F(StudyRunTest, CtrlCEndsWithFourAndLeavesNoLock) {
  Program program(words("65536"), said_);
  ASSERT_TRUE(wait_until([&] {
    const std::vector<std::string> files = files_below(folder_.path());
    return std::ranges::any_of(files, [](const std::string& f) { return f.ends_with("config.resolved.toml"); });
  }));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 4) << said();
  for (const std::string& file : files_below(folder_.path())) EXPECT_THAT(file, Not(testing::EndsWith(".lock")));
  EXPECT_FALSE(fs::exists(run() / "DONE") || fs::exists(run() / "FAILED"));
}

TEST(GenerateSheet, ShowsEveryViewOnce) {
  ScratchFolder folder("clerestory-generate-sheet");
  Program program({"generate", "--out", folder / "rooms", "--rooms", "3", "--views", "1", "--size", "32x24", "--spp",
                   "4", "--box-rooms", "--no-light", "--sheet", folder / "sheet.png"},
                  folder / "said.txt");
  ASSERT_EQ(program.wait(), 0) << text_of(folder / "said.txt");
  const Image sheet = read_image(folder / "sheet.png");
  ASSERT_EQ(sheet.width, 2 * 32);
  ASSERT_EQ(sheet.height, 2 * 24);
  const auto sum = [&](int x0, int y0) {
    double all = 0;
    for (int y = y0; y < y0 + 24; ++y)
      for (int x = x0; x < x0 + 32; ++x) all += static_cast<double>(sheet.at(0, y, x));
    return all;
  };
  EXPECT_GT(sum(0, 0), 0);
  EXPECT_GT(sum(32, 0), 0);
  EXPECT_GT(sum(0, 24), 0);
  EXPECT_EQ(sum(32, 24), 0) << "three rooms leave one place of four";

  Program nowhere({"generate", "--out", folder / "more", "--box-rooms", "--sheet", folder / "none/sheet.png"},
                  folder / "said.txt");
  EXPECT_EQ(nowhere.wait(), 2);
  EXPECT_THAT(text_of(folder / "said.txt"), HasSubstr("none"));
  EXPECT_FALSE(fs::exists(folder / "more")) << "the place of the sheet is tried before the work";
}

TEST(GenerateInterrupted, CtrlCEndsWithFourAndLeavesNoPartialFiles) {
  ScratchFolder folder("clerestory-generate-interrupted");
  Program program({"generate", "--out", folder / "rooms", "--rooms", "50", "--views", "4", "--size", "64x48", "--spp",
                   "64", "--box-rooms", "--no-light"},
                  folder / "said.txt");
  ASSERT_TRUE(wait_until([&] { return !files_below(folder / "rooms").empty(); }));
  program.signal(SIGTERM);
  EXPECT_EQ(program.wait(), 4) << text_of(folder / "said.txt");
  for (const std::string& file : files_below(folder / "rooms"))
    EXPECT_THAT(file, testing::AllOf(Not(HasSubstr(".tmp")), Not(HasSubstr(".lock")), Not(HasSubstr(".partial"))));
}

}  // namespace
}  // namespace clerestory
