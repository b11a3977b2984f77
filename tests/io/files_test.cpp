// Whole files: bounds, atomic replacement, every way a place can be wrong.
#include "host/io/files.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "tests/io/testing.hpp"

namespace clerestory {
namespace {

class Files : public Scratch {};

TEST_F(Files, RoundTrip) {
  const std::string bytes("a\0b\n\xff", 5);
  write_file(folder / "f", bytes);
  EXPECT_EQ(read_file(folder / "f"), bytes);
  write_file(folder / "f", "shorter");
  EXPECT_EQ(read_file(folder / "f"), "shorter");
  EXPECT_EQ(entries(), 1u) << "no temporary is left";
}

TEST_F(Files, RefusesWhatIsNoFile) {
  expect_error([&] { read_file(folder / "missing"); }, {"missing", "No such file"});
  expect_error([&] { read_file(folder); }, {folder.string(), "is a folder"});
  expect_error([&] { read_file(put("empty", "")); }, {"empty", "is empty"});
  EXPECT_EQ(read_file(put("empty", ""), 10, true), "");
  expect_error([&] { read_file(put("large", "12345"), 4); }, {"large", "5 bytes", "at most 4"});
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  expect_error([&] { read_file(folder / "pipe"); }, {"pipe", "not a regular file"});
}

TEST_F(Files, RefusesPlacesThatCannotBeWritten) {
  std::filesystem::create_directories(folder / "sub");
  expect_error([&] { write_file(folder / "sub", "x"); }, {"sub", "is a folder"});
  expect_error([&] { write_file(folder / "nowhere/f", "x"); }, {"nowhere/f", "No such file"});
  const auto file = put("file", "x");
  expect_error([&] { write_file(file / "f", "x"); }, {"Not a directory"});
  expect_error([&] { make_directories(file); }, {"file", "folder"});
  expect_error([&] { make_directories(file / "deeper"); }, {"deeper", "Not a directory"});
  expect_error([&] { make_directories("/proc/clerestory"); }, {"/proc/clerestory"});
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  expect_error([&] { write_file(folder / "pipe", "x"); }, {"pipe", "not a regular file"});
  EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
  make_directories(folder / "a/b/c");
  make_directories(folder / "a/b/c");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "a/b/c"));
}

/// A process that dies in the middle of writing `path`, as by kill -9.
void killed_while_writing(const std::filesystem::path& path) {
  const pid_t child = fork();
  if (child == 0) {
    AtomicFile file(path);
    file.write("half of");
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
}

TEST_F(Files, RemovesWhatAKilledWriterLeft) {
  killed_while_writing(folder / "f");
  ASSERT_EQ(entries(), 1u) << "a killed process cannot clear up";
  put(".f.notes.tmp", "not ours");
  put(".g.12-3.tmp", "of another file");
  AtomicFile other(folder / "f");  // at work, in this process or in any other
  write_file(folder / "f", "whole");
  EXPECT_EQ(entries(), 4u) << "f, its other writer's, and those of other names";
  EXPECT_EQ(read_file(folder / ".f.notes.tmp"), "not ours");
  other.write("later");
  other.commit();
  EXPECT_EQ(read_file(folder / "f"), "later");
  EXPECT_EQ(entries(), 3u);
}

// In a container a program has one number in every run.
TEST_F(Files, WhatAKilledWriterOfOurOwnNumberLeftIsNotInTheWay) {
  for (int counter = 0; counter < 1000; ++counter) put(fmt::format(".f.{}-{}.tmp", ::getpid(), counter), "half of");
  write_file(folder / "f", "whole");
  EXPECT_EQ(read_file(folder / "f"), "whole");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, KeepsTheOldFileUntilCommit) {
  write_file(folder / "f", "old");
  {
    AtomicFile file(folder / "f");
    file.write("new");
    EXPECT_EQ(read_file(folder / "f"), "old");
  }
  EXPECT_EQ(read_file(folder / "f"), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, ALinkStaysAndItsFileIsReplaced) {
  std::filesystem::create_directories(folder / "disk");
  put("disk/file", "old");
  std::filesystem::create_symlink("disk/file", folder / "link");
  std::filesystem::create_symlink("disk/new", folder / "dangling");
  write_file(folder / "link", "new");
  write_file(folder / "dangling", "made");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(get(folder / "disk/file"), "new");
  EXPECT_EQ(get(folder / "disk/new"), "made");
}

TEST_F(Files, FullDiskLeavesTheOldFile) {
  write_file(folder / "f", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 4096;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  expect_error([&] { write_file(folder / "f", std::string(100000, 'x')); }, {"f", "writing failed", "large"},
               ErrorKind::Failed);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(read_file(folder / "f"), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, ManyWritersOfOneFile) {
  std::vector<std::thread> threads;
  for (char c = 'a'; c < 'e'; ++c)
    threads.emplace_back([this, c] {
      for (int i = 0; i < 25; ++i) write_file(folder / "f", std::string(5000, c));
    });
  for (auto& thread : threads) thread.join();
  const std::string text = read_file(folder / "f");
  EXPECT_EQ(text, std::string(5000, text[0])) << "one writer's bytes, whole";
  EXPECT_EQ(entries(), 1u);
}

TEST_F(Files, InputFileReadsAnywhere) {
  const InputFile file(put("f", "0123456789"));
  EXPECT_EQ(file.size(), 10u);
  char part[4] = {};
  file.read(part, 3, 7);
  EXPECT_STREQ(part, "789");
  expect_error([&] { file.read(part, 3, 8); }, {"ends too early"});
}

TEST_F(Files, Hash) {
  // FNV-1a's published values.
  EXPECT_EQ(content_hash(""), 0xcbf29ce484222325u);
  EXPECT_EQ(content_hash("a"), 0xaf63dc4c8601ec8cu);
  EXPECT_EQ(content_hash("foobar"), 0x85944171f73967e8u);
  EXPECT_EQ(content_hash("bar", content_hash("foo")), content_hash("foobar"));
  EXPECT_EQ(file_hash(put("f", "foobar")), "85944171f73967e8");
}

}  // namespace
}  // namespace clerestory
