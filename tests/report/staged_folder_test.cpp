#include "host/report/staged_folder.hpp"

#include <signal.h>

#include "host/error.hpp"
#include "host/report/own_files.hpp"
#include "tests/report/in_child.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class StagedFolderTest : public InTemporaryFolder {
 protected:
  /// Makes what lies in a folder its own.
  static void put_results(const fs::path& folder) {
    Provenance provenance = begin_provenance({"clerestory"});
    provenance.outputs = record_files_in(folder);
    write_provenance(folder / kProvenanceName, provenance);
  }
};

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
  { StagedFolder staged(folder_ / "new/a/office"); }
  EXPECT_TRUE(names_in(folder_).empty()) << "nor of the folders above it that were made";
}

TEST_F(StagedFolderTest, ReplacesItsOwnKindOnly) {
  const fs::path target = folder_ / "office";
  fs::create_directory(target);
  put(target / "old.png", "old");
  put_results(target);
  {
    StagedFolder staged(target.string() + "/");
    put(staged / "provenance.json", "new");
    EXPECT_NE(text_of(target / "provenance.json"), "new");
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
  put_results(folder_ / ".office.old");
  const std::string old = text_of(folder_ / ".office.old" / "provenance.json");
  { StagedFolder staged(folder_ / "office"); }
  EXPECT_EQ(text_of(folder_ / "office" / "provenance.json"), old);
}

TEST_F(StagedFolderTest, WhatOnlyLooksLikeAReplacedFolderIsKept) {
  fs::create_directory(folder_ / "office");
  put_results(folder_ / "office");
  fs::create_directory(folder_ / ".office.old");
  put(folder_ / ".office.old" / "thesis.tex", "years of work");
  EXPECT_THROW(StagedFolder{folder_ / "office"}, Error);
  EXPECT_EQ(text_of(folder_ / ".office.old" / "thesis.tex"), "years of work");
  put_results(folder_ / ".office.old");
  { StagedFolder staged(folder_ / "office"); }
  EXPECT_FALSE(fs::exists(folder_ / ".office.old"));
}

TEST_F(StagedFolderTest, FilesOfOthersThatCameMeanwhileAreNotReplaced) {
  const fs::path target = folder_ / "office";
  fs::create_directory(target);
  put_results(target);
  for (const bool force : {false, true}) {
    StagedFolder staged(target, {.inputs = {}, .force = force});
    put(staged / "provenance.json", "{}");
    put(target / "notes.txt", "a thought");
    if (force)
      EXPECT_NO_THROW(staged.commit());
    else
      EXPECT_THROW(staged.commit(), Error);
    EXPECT_EQ(fs::exists(target / "notes.txt"), !force);
  }
}

TEST_F(StagedFolderTest, WhatLooksLikeAnInputInsideButIsNotDoesNoHarm) {
  fs::create_directory(folder_ / "office");
  put_results(folder_ / "office");
  put(folder_ / "photo.png", "");
  EXPECT_NO_THROW(StagedFolder(folder_ / "office", {{folder_ / "office" / ".." / "photo.png", {}}}));
  put(folder_ / "office.png", "");
  EXPECT_NO_THROW(StagedFolder(folder_ / "office", {{folder_ / "office.png"}}));
  EXPECT_THROW(StagedFolder(folder_ / "office", {{folder_ / "office" / "photo"}}), Error) << "a prefix of files";
}

TEST_F(StagedFolderTest, OnlyWhatTheProgramLeavesBehindIsItsOwn) {
  const fs::path target = folder_ / "office";
  fs::create_directories(target / ".edit.partial");
  put_results(target);
  put(target / ".composite.exr.4711-0.tmp", "half"), put(target / ".edit.lock", "");
  put(target / ".probe.lock", "pid 4711 on here\n");
  EXPECT_NO_THROW(StagedFolder{target});
  for (const char* name : {".thoughts.tmp", ".keys.lock", ".tmp"}) {
    put(target / name, "somebody's");
    EXPECT_THROW(StagedFolder{target}, Error) << name;
    fs::remove(target / name);
  }
}

TEST_F(StagedFolderTest, AResultThatWasChangedIsNotReplaced) {
  const fs::path target = folder_ / "office";
  fs::create_directory(target);
  put(target / "mask.txt", "written");
  put_results(target);
  put(target / "mask.txt", "by hand");  // as long as it was
  EXPECT_THROW(StagedFolder{target}, Error);
}

TEST_F(StagedFolderTest, ALinkInsideThatAnInputIsNamedByIsNotReplaced) {
  const fs::path target = folder_ / "office";
  fs::create_directory(target);
  put_results(target);
  put(folder_ / "photo.png", "");
  fs::create_symlink(folder_ / "photo.png", target / "photo.png");
  EXPECT_THROW(StagedFolder(target, {.inputs = {target / "photo.png"}, .force = true}), Error);
  EXPECT_TRUE(fs::is_symlink(target / "photo.png"));
}

// It cannot be renamed, which is to be known before the work.
TEST_F(StagedFolderTest, AMountPointIsRefused) {
  try {
    StagedFolder staged("/proc");
    FAIL() << "/proc";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage);
    EXPECT_NE(std::string(error.what()).find("mount"), std::string::npos) << error.what();
  }
}

TEST_F(StagedFolderTest, ANameThatIsTooLongIsBadUsage) {
  try {
    StagedFolder staged(folder_ / std::string(300, 'x'));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Usage) << error.what();
  }
}

TEST_F(StagedFolderTest, WhoWorksInsideKeepsTheFolderFromBeingReplaced) {
  const fs::path target = folder_ / "office";
  fs::create_directories(target / "edit");
  put_results(target);
  const FolderLock inside(target / "edit", LockKind::Write);
  EXPECT_EQ(in_child([&] {
              try {
                StagedFolder staged(target, {.inputs = {}, .force = true});
              } catch (const Error& error) {
                return std::string(error.what()).find("another process") != std::string::npos ? 7 : 8;
              }
              return 9;
            }),
            7);
}

}  // namespace
}  // namespace clerestory
