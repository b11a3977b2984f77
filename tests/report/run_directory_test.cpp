#include "host/report/run_directory.hpp"

#include <signal.h>

#include "host/error.hpp"
#include "host/report/metrics.hpp"
#include "tests/report/in_child.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

Schema schema() {
  Schema s;
  s.integer("width", 64, "Channels.").text("title", "", "Heading.");
  s.aside();
  return s;
}

class RunDirectoryTest : public InTemporaryFolder {
 protected:
  RunDirectory open(const std::vector<std::string>& overrides = {}, bool restart = false) const {
    return RunDirectory(folder_, "study", "narrow", Config(schema(), overrides), 3, restart);
  }
};

TEST_F(RunDirectoryTest, NameAndContents) {
  const Config config(schema());
  {
    const RunDirectory run = open();
    EXPECT_EQ(run.path(), folder_ / "study" / ("narrow-" + config_hash(config) + "-s3"));
    EXPECT_EQ(text_of(run / "config.resolved.toml"), config_toml(config));
    EXPECT_FALSE(run.done());
    EXPECT_FALSE(run.resumable());
    run.log("hello");
    EXPECT_NE(text_of(run / "log.txt").find("Z hello\n"), std::string::npos);
    run.finish();
    EXPECT_EQ(names_in(run.path()),
              (Names{".lock", "DONE", "artifacts", "checkpoints", "config.resolved.toml", "log.txt"}));
  }
  EXPECT_TRUE(open().done());
  EXPECT_TRUE(open({"title=other"}).done()) << "a key that stands aside names no other run";
  EXPECT_FALSE(open({"width=3"}).done());
  EXPECT_FALSE(open({}, true).done()) << "a restart starts from nothing";
}

TEST_F(RunDirectoryTest, BadInputLeavesNothingOfARunThatIsNew) {
  open().fail(usage_error("no such file"), false);
  EXPECT_TRUE(names_in(folder_).empty()) << "nor the folders above it";
  open().fail(Error(ErrorKind::Interrupted, "Ctrl-C"), false);
  EXPECT_FALSE(fs::exists(open() / "FAILED"));
  open().fail(usage_error("no such file"), false);
  EXPECT_TRUE(fs::exists(open() / "FAILED")) << "it was here before";
  const RunDirectory other = open({"width=3"});
  other.fail(usage_error("a second file is damaged"), true);
  EXPECT_TRUE(fs::exists(other / "FAILED")) << "it has results";
}

TEST_F(RunDirectoryTest, ResumeCutsBackToTheCheckpoint) {
  const RunDirectory run = open();
  put(run.checkpoint_path(10), "a");
  put(run.checkpoint_path(20), "b");
  put(run.checkpoint_path(30), "c");
  put(run / "checkpoints" / "step-00000040.safetensors.tmp", "torn");
  put(run / "checkpoints" / "step-x.safetensors", "not ours");
  {
    MetricsWriter writer(run.metrics_path());
    for (int step = 1; step <= 35; ++step) writer.write(step, {{"loss", 1}});
  }
  run.fail(usage_error("out of memory"), true);
  EXPECT_NE(text_of(run / "FAILED").find("out of memory"), std::string::npos);
  ASSERT_TRUE(run.resumable());
  EXPECT_EQ(run.latest_checkpoint()->step, 30);

  run.resume_at(20);
  EXPECT_EQ(run.latest_checkpoint()->step, 20);
  EXPECT_EQ(run.latest_checkpoint()->path, run.checkpoint_path(20));
  EXPECT_EQ(read_metrics(run.metrics_path()).back().step, 20);
  EXPECT_FALSE(fs::exists(run / "FAILED"));

  put(run.checkpoint_path(25), "d");
  run.prune_checkpoints(2);
  EXPECT_FALSE(fs::exists(run.checkpoint_path(10)));
  EXPECT_TRUE(fs::exists(run.checkpoint_path(20)) && fs::exists(run.checkpoint_path(25)));
}

TEST_F(RunDirectoryTest, SecondProcessIsRefusedAndACrashFreesTheLock) {
  {
    const RunDirectory run = open();
    const int status = in_child([&] {
      try {
        open();
      } catch (const Error& error) {
        return error.kind() == ErrorKind::Usage &&
                       std::string(error.what()).find("another process") != std::string::npos
                   ? 7
                   : 8;
      }
      return 9;
    });
    EXPECT_EQ(status, 7);
  }
  const int crashed = in_child([&] {
    const RunDirectory run = open();
    raise(SIGKILL);
    return 0;
  });
  EXPECT_EQ(crashed, -1);
  EXPECT_NO_THROW(open()) << "the lock of a dead process is no lock";
}

TEST_F(RunDirectoryTest, EditedConfigIsRefused) {
  const fs::path path = open().path();
  put(path / "config.resolved.toml", "width = 65\n");
  EXPECT_THROW(open(), Error);
  put(path / "config.resolved.toml", "height = 65\n");
  try {
    open();
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("does not read"), std::string::npos) << error.what();
  }
}

TEST_F(RunDirectoryTest, NamesMustFitAFolder) {
  const Config config(schema());
  EXPECT_THROW(RunDirectory(folder_, "../x", "a", config, 0), Error);
  EXPECT_THROW(RunDirectory(folder_, "x", "", config, 0), Error);
  put(folder_ / "file", "");
  EXPECT_THROW(RunDirectory(folder_ / "file", "x", "a", config, 0), Error);
}

}  // namespace
}  // namespace clerestory
