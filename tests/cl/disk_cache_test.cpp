// Entries kept between runs survive whole or not at all.
#include "host/cl/disk_cache.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/cl/environment.hpp"

namespace clerestory {
namespace {

const std::string content = std::string("line\n\0binary\xff", 13) + std::string(1000, 'x');

TEST(DiskCache, GivesBackWhatWasStored) {
  ScopedFolder folder;
  const DiskCache cache(folder.path());
  EXPECT_FALSE(cache.load("program", "key"));
  cache.store("program", "key\nof two lines", content);
  EXPECT_EQ(cache.load("program", "key\nof two lines"), content);
  EXPECT_FALSE(cache.load("program", "key"));
  EXPECT_FALSE(cache.load("probe", "key\nof two lines"));
  cache.store("program", "key\nof two lines", "");
  EXPECT_EQ(cache.load("program", "key\nof two lines"), "");
}

TEST(DiskCache, LeavesNoTemporaryFiles) {
  ScopedFolder folder;
  DiskCache(folder.path()).store("program", "key", content);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    files += entry.path().extension() == ".bin" ? 1 : 100;
  EXPECT_EQ(files, 1);
}

TEST(DiskCache, AnyDamageMakesAnEntryAbsent) {
  ScopedFolder folder;
  const DiskCache cache(folder.path());
  cache.store("program", "key", content);
  const std::filesystem::path file = cache.path("program", "key");
  const std::string whole = read_text(file);
  ASSERT_GT(whole.size(), 7u);
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    folder.write(file.filename().string(), damaged);
    EXPECT_FALSE(cache.load("program", "key")) << "byte " << at;
    folder.write(file.filename().string(), whole.substr(0, at));
    EXPECT_FALSE(cache.load("program", "key")) << "cut at " << at;
  }
  folder.write(file.filename().string(), whole + "x");
  EXPECT_FALSE(cache.load("program", "key"));
  folder.write(file.filename().string(), whole);
  EXPECT_EQ(cache.load("program", "key"), content);
}

TEST(DiskCache, AFolderOrAPipeInItsPlaceIsAbsentAndMadeAgain) {
  ScopedFolder folder;
  const DiskCache cache(folder.path());
  const std::filesystem::path file = cache.path("program", "key");
  std::filesystem::create_directory(file);
  EXPECT_FALSE(cache.load("program", "key"));
  cache.store("program", "key", content);
  EXPECT_EQ(cache.load("program", "key"), content);

  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_FALSE(cache.load("program", "key"));
  cache.store("program", "key", content);
  EXPECT_EQ(cache.load("program", "key"), content);

  // What is somebody's is left alone, and nothing is kept.
  std::filesystem::remove(file);
  folder.write(file.filename().string() + "/notes.txt", "not ours");
  cache.store("program", "key", content);
  EXPECT_FALSE(cache.load("program", "key"));
  EXPECT_EQ(read_text(file / "notes.txt"), "not ours");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1) << "a temporary was left";
}

TEST(DiskCache, AnEntryOfAnotherKeyUnderTheSameNameIsAbsent) {
  ScopedFolder folder;
  const DiskCache cache(folder.path());
  cache.store("program", "one", content);
  std::filesystem::rename(cache.path("program", "one"), cache.path("program", "two"));
  EXPECT_FALSE(cache.load("program", "two"));
}

TEST(DiskCache, LiesWhereTheBaseDirectorySpecificationSays) {
  ScopedVariable home("HOME", "/home/somebody");
  {
    ScopedVariable cache("XDG_CACHE_HOME", "/elsewhere");
    EXPECT_EQ(DiskCache().path("probe", "key").parent_path(), "/elsewhere/clerestory");
  }
  for (const char* unusable : {"", "relative"}) {
    ScopedVariable cache("XDG_CACHE_HOME", unusable);
    EXPECT_EQ(DiskCache().path("probe", "key").parent_path(), "/home/somebody/.cache/clerestory");
  }
}

TEST(DiskCache, WithoutAPlaceToWriteItStaysEmpty) {
  ScopedFolder folder;
  const std::filesystem::path file = folder.write("file", "not a folder");
  const DiskCache cache(file / "below");
  cache.store("program", "key", content);
  EXPECT_FALSE(cache.load("program", "key"));
  ScopedVariable home("HOME", ""), xdg("XDG_CACHE_HOME", "");
  EXPECT_TRUE(DiskCache().path("program", "key").empty());
  DiskCache().store("program", "key", content);
  EXPECT_FALSE(DiskCache().load("program", "key"));
}

}  // namespace
}  // namespace clerestory
