#include "host/report/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <vector>

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

// Who leaves holds the file alone for a moment, to remove it.
TEST_F(FileLockTest, ReadersThatComeAndGoDoNotKeepEachOtherOut) {
  std::atomic<int> refused = 0;
  std::vector<std::thread> readers;
  for (int t = 0; t < 3; ++t)
    readers.emplace_back([&] {
      for (int i = 0; i < 2000; ++i) try {
          const FileLock reader(path(), LockKind::Read);
        } catch (const AtWork&) {
          ++refused;
        }
    });
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(refused, 0);
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

TEST_F(FileLockTest, NamesTheWriterThatHoldsIt) {
  char host[256];
  ASSERT_EQ(gethostname(host, sizeof host), 0);
  const auto refused = [&](LockKind kind) {
    try {
      FileLock lock(path(), kind, "the run");
    } catch (const AtWork& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  put(path(), "pid 1 on a host whose name is long, of one that was killed\n");
  {
    const FileLock writer(path());
    const std::string name = "pid " + std::to_string(getpid()) + " on " + host;
    EXPECT_EQ(text_of(path()), name + "\n");
    EXPECT_EQ(refused(LockKind::Write), "the run: another process is at work here (found " + name + ")");
    EXPECT_EQ(refused(LockKind::Read), refused(LockKind::Write));
  }
  put(path(), "pid 1 on one that was killed\n");
  const FileLock reader(path(), LockKind::Read);
  EXPECT_EQ(refused(LockKind::Write), "the run: another process is at work here") << "not by the dead one";
}

TEST_F(FileLockTest, WhatAKilledHolderLeavesIsKnown) {
  for (const char* left : {"", "pid 4711 on here.example.org\n"}) {
    put(path(), left);
    EXPECT_TRUE(is_left_lock(path())) << left;
  }
  for (const std::string& other : {std::string("pid"), std::string("pid 4 on x\nand more\n"), std::string(400, 'x')}) {
    put(path(), other);
    EXPECT_FALSE(is_left_lock(path())) << other;
  }
  EXPECT_FALSE(is_left_lock(folder_ / "none")) << "there is none";
}

TEST_F(FileLockTest, WhoWaitsHasItWhenTheOtherIsDone) {
  std::optional<FileLock> other(path());
  EXPECT_THROW(wait_for_lock(path(), 0.1), AtWork);
  std::atomic<bool> released = false;
  std::thread gives_it_back([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    released = true, other.reset();
  });
  const FileLock mine = wait_for_lock(path(), 60);
  EXPECT_TRUE(released);
  gives_it_back.join();
  EXPECT_FALSE(can(LockKind::Read));
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
