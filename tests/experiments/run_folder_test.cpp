// What becomes of a user's files: what a command replaces in a run folder, and what it never touches.
#include "tests/experiments/run_folder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "host/io/image.hpp"
#include "host/report/file_lock.hpp"
#include "tests/experiments/program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST_F(RunFolder, ReplacesItsOwnKind) {
  put(run() / "report.html", "made again by `clerestory report`");
  EXPECT_EQ(start(taken_apart(photo(), run())), 0) << said();
  EXPECT_EQ(files_below(run()), files_below(*made_ / "run"));
}

TEST_F(RunFolder, RefusesToReplaceAFolderWithForeignFiles) {
  put(run() / "notes.txt", "a week of thoughts");
  fs::create_directory(run() / "old");
  put(run() / "old" / "first.exr", "");
  put(run() / "albedo.png", "painted over by hand");
  const std::vector<std::string> before = files_below(run());
  expect_refused(taken_apart(photo(), run()), "--force");
  EXPECT_THAT(said(), AllOf(HasSubstr("notes.txt"), HasSubstr("old/"), HasSubstr("albedo.png"), HasSubstr("--force")));
  EXPECT_THAT(said(), Not(HasSubstr("normal.png")));
  EXPECT_THAT(said(), Not(HasSubstr("chunks of rays"))) << "refused before anything is rendered";
  EXPECT_EQ(files_below(run()), before);
  EXPECT_EQ(text_of(run() / "notes.txt"), "a week of thoughts");
  EXPECT_EQ(text_of(run() / "albedo.png"), "painted over by hand");

  Words words = taken_apart(photo(), run());
  words.push_back("--force");
  EXPECT_EQ(start(words), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("notes.txt"), HasSubstr("old/"), HasSubstr("albedo.png")));
  EXPECT_EQ(files_below(run()), files_below(*made_ / "run"));
}

TEST_F(RunFolder, RefusesToReplaceResultsMadeFromIt) {
  ASSERT_EQ(start(inserted()), 0) << said();
  ASSERT_EQ(start(edited()), 0) << said();
  ASSERT_EQ(start(lit()), 0) << said();
  const std::vector<std::string> before = files_below(run());
  expect_refused(taken_apart(photo(), run()), "--force");
  EXPECT_THAT(said(), AllOf(HasSubstr("composite.exr"), HasSubstr("edit/"), HasSubstr("light.exr")));
  EXPECT_EQ(files_below(run()), before);
  EXPECT_EQ(start(inserted()), 0) << "each replaces its own: " << said();
  EXPECT_EQ(start(edited()), 0) << said();
  EXPECT_EQ(start(lit()), 0) << said();
  EXPECT_EQ(files_below(run()), before);
}

TEST_F(RunFolder, AnInputInsideIsNeverDeleted) {
  const fs::path inside = run() / "room.exr";
  fs::copy(photo(), inside);
  fs::create_directory_symlink(run(), folder_ / "link");
  fs::create_symlink(inside, folder_ / "room.exr");
  const std::string bytes = text_of(inside);
  for (const fs::path& photograph : {inside, folder_ / "link" / "room.exr", folder_ / "room.exr"})
    for (const char* force : {"", "--force"}) {
      Words words = taken_apart(photograph, run());
      if (*force) words.push_back(force);
      expect_refused(words, "room.exr");
      EXPECT_THAT(said(), HasSubstr("lies inside")) << photograph;
      EXPECT_EQ(text_of(inside), bytes) << photograph;
    }
  fs::remove(inside);
  // Every other kind of input.
  const Words from_run{"invert", photo(), "--gbuffer", run(),   "--light", "image",
                       "--spp",  "2",     "--force",   "--out", run()};
  expect_refused(from_run, "lies inside");
  Words words{"invert", photo(), "--camera", run() / "camera.json", "--force", "--out", run()};
  expect_refused(words, "lies inside");
  words = {"invert", photo(), "--weights", run() / "my.safetensors", "--force", "--out", run()};
  expect_refused(words, "lies inside");
  words = {"invert", photo(), "--light", "net", "--light-weights", run(), "--force", "--out", run()};
  expect_refused(words, "lies inside");
  expect_refused(edited({"--out", run(), "--force"}), "lies inside");
  EXPECT_EQ(files_below(run()), files_below(*made_ / "run"));
}

TEST_F(RunFolder, AFolderThatIsNoRunIsNeverReplaced) {
  const fs::path home = folder_ / "home";
  fs::create_directory(home);
  put(home / "thesis.tex", "years of work");
  for (const char* force : {"", "--force"}) {
    Words words = taken_apart(photo(), home);
    if (*force) words.push_back(force);
    expect_refused(words, home.string());
    EXPECT_EQ(files_below(home), Words{"thesis.tex"});
  }
}

TEST_F(RunFolder, TwoPhotographsOfOneNameAreTwoRuns) {
  const Surroundings here{folder_.path(), {}};
  for (const char* name : {"attic", "cellar"}) fs::create_directory(folder_ / name);
  fs::copy(photo(), folder_ / "attic" / "rgb.exr");
  Image other = read_map(photo(), 3);
  other.data[7] += 0.5f;
  write_exr(folder_ / "cellar" / "rgb.exr", other);
  const fs::path runs = folder_ / "runs" / "invert";
  const auto names = [&] {
    std::set<std::string> found;
    for (const auto& entry : fs::directory_iterator(runs)) found.insert(entry.path().filename());
    return found;
  };
  ASSERT_EQ(start(taken_apart("attic/rgb.exr", {}), here), 0) << said();
  EXPECT_EQ(names(), (std::set<std::string>{"rgb"}));
  ASSERT_EQ(start(taken_apart("cellar/rgb.exr", {}), here), 0) << said();
  EXPECT_EQ(names(), (std::set<std::string>{"rgb", "cellar-rgb"}));
  EXPECT_THAT(said(), HasSubstr("runs/invert/cellar-rgb"));
  EXPECT_EQ(record(runs / "rgb" / "provenance.json")["inputs"][0]["path"], "attic/rgb.exr");
  EXPECT_EQ(record(runs / "cellar-rgb" / "provenance.json")["inputs"][0]["path"], "cellar/rgb.exr");
  // Each again: into its own.
  ASSERT_EQ(start(taken_apart("cellar/rgb.exr", {}), here), 0) << said();
  ASSERT_EQ(start(taken_apart("attic/rgb.exr", {}), here), 0) << said();
  EXPECT_EQ(names(), (std::set<std::string>{"rgb", "cellar-rgb"}));
  EXPECT_EQ(record(runs / "cellar-rgb" / "provenance.json")["inputs"][0]["path"], "cellar/rgb.exr");
  // What is in it by hand is safe there too.
  put(runs / "rgb" / "notes.txt", "");
  EXPECT_EQ(start(taken_apart("attic/rgb.exr", {}), here), kUsage);
  EXPECT_THAT(said(), HasSubstr("notes.txt"));
}

TEST_F(RunFolder, FilesBesideAPanoramaAreNotReplaced) {
  put(folder_ / "room.png", "the photograph itself");
  expect_refused(lit({"--out", folder_ / "room.exr"}), "room.png");
  EXPECT_EQ(text_of(folder_ / "room.png"), "the photograph itself");
  EXPECT_FALSE(fs::exists(folder_ / "room.exr"));
  expect_refused(lit({"--out", run() / "albedo.exr"}), "albedo.exr");
  EXPECT_EQ(start(lit({"--out", folder_ / "room.exr", "--force"})), 0) << said();
  put(folder_ / "composite.png", "by another program");
  expect_refused(inserted({"--out", folder_.path()}), "composite.png");
  EXPECT_EQ(text_of(folder_ / "composite.png"), "by another program");
}

TEST_F(RunFolder, AnInsertionThatWasChangedByHandIsNotReplaced) {
  EXPECT_EQ(start(inserted()), 0) << said();
  put(run() / "composite.png", "painted over by hand");
  expect_refused(inserted(), "composite.png");
  EXPECT_THAT(said(), Not(HasSubstr("composite.exr"))) << "that is as it was written";
  EXPECT_EQ(text_of(run() / "composite.png"), "painted over by hand");
}

TEST_F(RunFolder, WeightsInsideAreNotReplacedByAnEdit) {
  const fs::path weights = run() / "edit";
  fs::create_directory(weights);
  put(weights / "light_local.safetensors", "of my own");
  Words words = edited({"--light-weights", weights, "--force"});
  std::ranges::replace(words, std::string("image"), std::string("net"));
  expect_refused(words, "lies inside");
  EXPECT_EQ(text_of(weights / "light_local.safetensors"), "of my own");
}

TEST_F(RunFolder, NothingStaysOfAFolderForResultsThatNeverCame) {
  expect_refused(inserted({"--at", "640,0", "--radius", "0.1", "--out", folder_ / "new"}), "outside of the picture");
  EXPECT_FALSE(fs::exists(folder_ / "new"));
  expect_refused(inserted({"--at", "640,0", "--radius", "0.1", "--out", folder_ / "new/a/b"}),
                 "outside of the picture");
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(RunFolder, TwoInsertionsIntoOneFolderAreKeptApart) {
  const fs::path out = folder_ / "out";
  fs::create_directory(out);
  {
    const FileLock other(out / ".insert.lock");
    expect_refused(inserted({"--out", out}), "another process is at work");
    ASSERT_EQ(start(lit({"--out", out / "light.exr"})), 0) << said() << " writes other files";
  }
  ASSERT_EQ(start(inserted({"--out", out})), 0) << said();
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(out)) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"composite.exr", "composite.png", "insert.json", "light.exr", "light.json",
                                          "light.png"}));
}

}  // namespace
}  // namespace clerestory
