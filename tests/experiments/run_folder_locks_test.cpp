// One writer at a time: what several processes may do with one run.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include "tests/experiments/program.hpp"
#include "tests/experiments/run_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// What another process of the program holds while it reads or writes a run.
struct Held {
  Held(const fs::path& run, int how) : file(run.parent_path() / fmt::format(".{}.lock", run.filename().string())) {
    descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    ::flock(descriptor, how);
  }
  ~Held() { ::unlink(file.c_str()), ::close(descriptor); }
  fs::path file;
  int descriptor = -1;
};

TEST_F(RunFolder, AWriterKeepsAllOthersOut) {
  const Held held(run(), LOCK_EX);
  const fs::path elsewhere = folder_ / "elsewhere";
  const Words words = taken_apart(photo(), elsewhere);
  Words from_run{"invert", photo(), "--gbuffer", run(), "--light", "image", "--spp", "2", "--out", elsewhere};
  for (const Words& command :
       {inserted(), inserted({"--out", elsewhere}), edited(), edited({"--out", elsewhere}), lit(),
        lit({"--out", folder_ / "probe.exr"}), Words{"report", run()}, taken_apart(photo(), run()), from_run})
    expect_refused(command, "another process is at work");
  EXPECT_EQ(files_below(run()), files_below(*made_ / "run"));
}

TEST_F(RunFolder, ReadersShareARunAndKeepWritersOut) {
  const Held held(run(), LOCK_SH);
  EXPECT_EQ(start(lit({"--out", folder_ / "probe.exr"})), 0) << said();
  EXPECT_EQ(start(edited({"--out", folder_ / "edited"})), 0) << said();
  EXPECT_EQ(start(edited()), 0) << "a folder of its own in the run: " << said();
  EXPECT_TRUE(fs::exists(held.file)) << "others still hold it";
  for (const Words& command : {inserted(), Words{"report", run()}, taken_apart(photo(), run())})
    expect_refused(command, "another process is at work");
}

TEST_F(RunFolder, ARunIsNotReplacedUnderAnEditOfIt) {
  ASSERT_EQ(start(edited()), 0) << said();
  // Who works on RUN/edit reads RUN.
  const std::string spp = "20000";
  Program editing({"edit", run() / "edit", "--mask", mask(), "--roughness", "0.1", "--light", "image", "--spp", spp},
                  folder_ / "editing.txt");
  ASSERT_TRUE(wait_until([&] { return text_of(folder_ / "editing.txt").find("chunks of rays") != std::string::npos; }));
  Words words = taken_apart(photo(), run());
  words.push_back("--force");
  expect_refused(words, "another process is at work");
  editing.signal(SIGINT);
  EXPECT_EQ(editing.wait(), kInterrupted);
}

TEST_F(RunFolder, AReportThatCannotBeMadeAgainIsSaid) {
  const Held held(run(), LOCK_SH);
  const std::string before = text_of(run() / "report.html");
  EXPECT_EQ(start(edited()), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("another process is at work"), HasSubstr("`clerestory report`")));
  EXPECT_EQ(text_of(run() / "report.html"), before);
}

}  // namespace
}  // namespace clerestory
