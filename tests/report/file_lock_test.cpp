#include "host/report/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <optional>

#include "host/error.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

class FileLockTest : public InTemporaryFolder {
 protected:
  bool can(LockKind kind) const {
    try {
      FileLock lock(path(), kind);
      return true;
    } catch (const Error&) {
      return false;
    }
  }
  std::filesystem::path path() const { return folder_ / ".lock"; }
};

TEST_F(FileLockTest, ManyReadersOrOneWriter) {
  {
    const FileLock reader(path(), LockKind::Read);
    EXPECT_TRUE(can(LockKind::Read));
    EXPECT_FALSE(can(LockKind::Write));
  }
  {
    const FileLock writer(path(), LockKind::Write);
    EXPECT_FALSE(can(LockKind::Read));
    EXPECT_FALSE(can(LockKind::Write));
  }
  EXPECT_TRUE(names_in(folder_).empty());
}

TEST_F(FileLockTest, TheLastHolderRemovesTheFile) {
  std::optional<FileLock> first, second;
  first.emplace(path(), LockKind::Read), second.emplace(path(), LockKind::Read);
  first.reset();
  EXPECT_EQ(names_in(folder_), std::vector<std::string>{".lock"}) << "the second still holds it";
  EXPECT_FALSE(can(LockKind::Write));
  second.reset();
  EXPECT_TRUE(names_in(folder_).empty());
}

TEST_F(FileLockTest, AFileThatAnotherMadeSinceStays) {
  {
    const FileLock lock(path());
    std::filesystem::remove(path());
    put(path(), "");
  }
  EXPECT_EQ(names_in(folder_), std::vector<std::string>{".lock"});
}

TEST_F(FileLockTest, MovedLocksAreHeldOnce) {
  FileLock lock(path());
  {
    const FileLock moved(std::move(lock));
    EXPECT_FALSE(can(LockKind::Read));
  }
  EXPECT_TRUE(can(LockKind::Write));
}

}  // namespace
}  // namespace clerestory
