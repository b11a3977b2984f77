#include "host/report/run_directory.hpp"

#include <signal.h>
#include <sys/wait.h>

#include "host/error.hpp"
#include "host/report/metrics.hpp"
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

/// Runs `work` in another process and gives its exit status.
template <class Work>
int in_child(const Work& work) {
  const pid_t child = fork();
  if (child == 0) _exit(work());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
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
  run.fail("out of memory");
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

class StagedFolderTest : public InTemporaryFolder {};

TEST_F(StagedFolderTest, AppearsWholeAtCommit) {
  const fs::path target = folder_ / "new" / "office";
  {
    StagedFolder staged(target);
    put(staged / "provenance.json", "{}");
    EXPECT_FALSE(fs::exists(target));
    EXPECT_EQ(staged.path().parent_path(), target.parent_path()) << "a rename must stay on one file system";
    staged.commit();
  }
  EXPECT_EQ(names_in(target), Names{"provenance.json"});
  EXPECT_EQ(names_in(target.parent_path()), Names{"office"}) << "nothing is left behind";
}

TEST_F(StagedFolderTest, WithoutCommitNothingIsLeft) {
  {
    StagedFolder staged(folder_ / "office");
    put(staged / "provenance.json", "{}");
  }
  EXPECT_TRUE(names_in(folder_).empty());
}

TEST_F(StagedFolderTest, ReplacesItsOwnKindOnly) {
  const fs::path target = folder_ / "office";
  fs::create_directory(target);
  put(target / "provenance.json", "old");
  put(target / "old.png", "old");
  {
    StagedFolder staged(target.string() + "/");
    put(staged / "provenance.json", "new");
    EXPECT_EQ(text_of(target / "provenance.json"), "old");
    staged.commit();
  }
  EXPECT_EQ(names_in(target), Names{"provenance.json"});
  EXPECT_EQ(text_of(target / "provenance.json"), "new");
  EXPECT_EQ(names_in(folder_), Names{"office"});

  const fs::path home = folder_ / "home";
  fs::create_directory(home);
  put(home / "thesis.tex", "years of work");
  EXPECT_THROW(StagedFolder{home}, Error);
  EXPECT_EQ(names_in(home), Names{"thesis.tex"});
  put(folder_ / "file", "text");
  EXPECT_THROW(StagedFolder{folder_ / "file"}, Error);
  EXPECT_THROW(StagedFolder{"/"}, Error);
  fs::create_directory(folder_ / "empty");
  StagedFolder empty(folder_ / "empty");
  put(empty / "provenance.json", "{}");
  EXPECT_NO_THROW(empty.commit());
}

TEST_F(StagedFolderTest, FilledMeanwhileIsNotReplaced) {
  StagedFolder staged(folder_ / "office");
  put(staged / "provenance.json", "{}");
  fs::create_directory(folder_ / "office");
  put(folder_ / "office" / "thesis.tex", "years of work");
  EXPECT_THROW(staged.commit(), Error);
  EXPECT_EQ(text_of(folder_ / "office" / "thesis.tex"), "years of work");
}

TEST_F(StagedFolderTest, FollowsALink) {
  fs::create_directories(folder_ / "disk" / "office");
  fs::create_directory_symlink(folder_ / "disk" / "office", folder_ / "link");
  StagedFolder staged(folder_ / "link");
  put(staged / "provenance.json", "{}");
  staged.commit();
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(names_in(folder_ / "disk" / "office"), Names{"provenance.json"});
}

TEST_F(StagedFolderTest, RemainsOfAKilledProcessAreCleared) {
  const int killed = in_child([&] {
    StagedFolder staged(folder_ / "office");
    put(staged / "half.exr", "half");
    raise(SIGKILL);
    return 0;
  });
  EXPECT_EQ(killed, -1);
  EXPECT_FALSE(fs::exists(folder_ / "office"));
  {
    StagedFolder staged(folder_ / "office");
    EXPECT_TRUE(names_in(staged.path()).empty());
    EXPECT_EQ(in_child([&] {
                try {
                  StagedFolder second(folder_ / "office");
                } catch (const Error&) {
                  return 7;
                }
                return 9;
              }),
              7)
        << "two processes, one target";
    put(staged / "provenance.json", "{}");
    staged.commit();
  }
  EXPECT_EQ(names_in(folder_), Names{"office"});
}

TEST_F(StagedFolderTest, OldFolderMovedAsideComesBack) {
  fs::create_directory(folder_ / ".office.old");
  put(folder_ / ".office.old" / "provenance.json", "old");
  { StagedFolder staged(folder_ / "office"); }
  EXPECT_EQ(text_of(folder_ / "office" / "provenance.json"), "old");
}

}  // namespace
}  // namespace clerestory
