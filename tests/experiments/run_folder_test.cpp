// What becomes of a user's files: run folders through the real program, on a small generated room with true maps. No
// weights are needed, and every light is the photograph.
#include "experiments/applications/run_folder.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "experiments/evaluation/real_scale.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/datasets.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/bare_room.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using Words = std::vector<std::string>;

constexpr int kUsage = 2, kInterrupted = 4;

void put(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// One bare room, its view taken apart once; each test works on a copy.
struct RunFolder : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    made_ = std::make_unique<ScratchFolder>("clerestory-run-folder-made");
    view_ = make_bare_room(Device::open(), *made_ / "rooms", 8);
    set_quiet(false);
    Program program(taken_apart(photo(), *made_ / "run"), *made_ / "said.txt");
    ASSERT_EQ(program.wait(), 0) << text_of(*made_ / "said.txt");
  }
  static void TearDownTestSuite() { made_.reset(); }

  static fs::path photo() { return view_.string() + "_im.exr"; }
  /// `invert` by true maps, in a second.
  static Words taken_apart(const fs::path& photograph, const fs::path& out) {
    Words words{"invert", photograph, "--gbuffer", view_, "--light", "image", "--spp", "2"};
    if (!out.empty()) words.insert(words.end(), {"--out", out});
    return words;
  }
  Words inserted(const Words& more = {}) const {
    Words words{"insert", run(), "--at", "32,40", "--radius", "0.1", "--light", "image", "--spp", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Words edited(const Words& more = {}) const {
    Words words{"edit", run(), "--mask", mask(), "--roughness", "0.5", "--light", "image", "--spp", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Words lit(const Words& more = {}) const {
    Words words{"light", run(), "--at", "32,40", "--size", "16x8", "--light", "image"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// A copy of the run, and a mask over half of its picture.
  void SetUp() override {
    fs::copy(*made_ / "run", run());
    Image half(64, 48, 1);
    std::fill(half.data.begin() + half.data.size() / 2, half.data.end(), 1.0f);
    write_png(mask(), half, Encoding::Linear);
  }
  fs::path run() const { return folder_ / "run"; }
  fs::path mask() const { return folder_ / "mask.png"; }

  int start(Words words, const Surroundings& around = {}) const { return Program(words, said_, around).wait(); }
  std::string said() const { return text_of(said_); }
  void expect_refused(const Words& words, const std::string& because) const {
    EXPECT_EQ(start(words), kUsage) << said();
    EXPECT_THAT(said(), HasSubstr(because));
  }
  nlohmann::json record(const fs::path& path) const { return nlohmann::json::parse(text_of(path)); }

  ScratchFolder folder_{"clerestory-run-folder"};
  fs::path said_ = folder_ / "said.txt";
  static inline std::unique_ptr<ScratchFolder> made_;
  static inline fs::path view_;
};

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

TEST_F(RunFolder, ItsReportShowsWhatWasMadeFromIt) {
  const auto page = [&] { return text_of(run() / "report.html"); };
  EXPECT_THAT(page(),
              AllOf(Not(HasSubstr("With objects")), Not(HasSubstr("Edited")), Not(HasSubstr("Light at points"))));
  ASSERT_EQ(start(inserted()), 0) << said();
  EXPECT_THAT(page(), HasSubstr("With objects"));
  ASSERT_EQ(start(edited()), 0) << said();
  EXPECT_THAT(page(), AllOf(HasSubstr("With objects"), HasSubstr("Edited"), HasSubstr("roughness 0.5")));
  ASSERT_EQ(start(lit()), 0) << said();
  EXPECT_THAT(page(), AllOf(HasSubstr("With objects"), HasSubstr("Edited"), HasSubstr("Light at points")));
  ASSERT_EQ(start(inserted({"--out", run() / "second"})), 0) << said();
  EXPECT_THAT(page(), HasSubstr("second/composite.exr"));
  // What lies elsewhere changes no page; the page made again says the same.
  const std::string before = page();
  ASSERT_EQ(start(lit({"--out", folder_ / "probe.exr"})), 0) << said();
  EXPECT_THAT(said(), HasSubstr("probe.exr is not on the page of"));
  EXPECT_EQ(page(), before);
  fs::create_directory(run() / "second/third");
  ASSERT_EQ(start(lit({"--out", run() / "second/third/probe.exr"})), 0) << said();
  EXPECT_THAT(said(), HasSubstr("probe.exr is not on the page of")) << "too deep";
  EXPECT_EQ(page(), before);
  ASSERT_EQ(start({"report", run()}), 0) << said();
  EXPECT_EQ(page(), before);
  EXPECT_THAT(page(), Not(HasSubstr(folder_.path().string()))) << "no folder of this computer";
  EXPECT_THAT(text_of(run() / "edit/report.html"),
              AllOf(HasSubstr("A material replaced"), HasSubstr("Before and after"), HasSubstr("Photograph")));
  const std::string edit = text_of(run() / "edit/report.html");
  ASSERT_EQ(start({"report", run() / "edit"}), 0) << said();
  EXPECT_EQ(text_of(run() / "edit/report.html"), edit);
}

TEST_F(RunFolder, AReportThatCannotBeMadeAgainIsSaid) {
  const Held held(run(), LOCK_SH);
  const std::string before = text_of(run() / "report.html");
  EXPECT_EQ(start(edited()), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("another process is at work"), HasSubstr("`clerestory report`")));
  EXPECT_EQ(text_of(run() / "report.html"), before);
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

// --- Nothing in silence ---------------------------------------------------------------------------------------------

TEST_F(RunFolder, ALightThatIsNotTheOneHopedForIsSaidAndRecorded) {
  const Surroundings without{{}, {{"CLERESTORY_LIGHT_WEIGHTS", folder_.path()}}};
  const fs::path out = folder_ / "by_default";
  ASSERT_EQ(start({"invert", photo(), "--gbuffer", view_, "--spp", "2", "--out", out}, without), 0) << said();
  const std::string why = "image, for there are no weights of the light in ";
  for (const std::string& text : {said(), text_of(out / "provenance.json")})
    EXPECT_THAT(text, HasSubstr(why + folder_.path().string()));
  EXPECT_THAT(text_of(out / "report.html"), HasSubstr(why + folder_.path().filename().string()));
  // Asked for, it is no fallback.
  ASSERT_EQ(start(taken_apart(photo(), folder_ / "asked"), without), 0) << said();
  EXPECT_EQ(record(folder_ / "asked" / "provenance.json")["facts"]["light"], "image");
  // Weights that are named are used, whatever is shipped.
  write_untrained_light(folder_ / "mine");
  const Words probe{"light",
                    run(),
                    "--at",
                    "32,40",
                    "--size",
                    "16x8",
                    "--light-weights",
                    folder_ / "mine",
                    "--out",
                    folder_ / "probe.exr"};
  ASSERT_EQ(start(probe, without), 0) << said();
  EXPECT_THAT(said(), HasSubstr("light: net (" + (folder_ / "mine").string()));
}

TEST_F(RunFolder, AMovedProgramFindsItsWeightsBesideIt) {
  fs::create_directories(folder_ / "moved/build");
  fs::copy(CLERESTORY_PROGRAM, folder_ / "moved/build/clerestory");
  write_untrained_light(folder_ / "moved/nets/weights");
  const Words probe{"light", run(), "--at", "32,40", "--size", "16x8", "--out", folder_ / "probe.exr"};
  ASSERT_EQ(start(probe, {{}, {}, folder_ / "moved/build/clerestory"}), 0) << said();
  const std::string light = record(folder_ / "probe.json")["facts"]["light"];
  EXPECT_EQ(light, "net (" + (folder_ / "moved/nets/weights").string() + ")");
  EXPECT_THAT(said(), HasSubstr("light: " + light));
}

TEST_F(RunFolder, ACameraThatIsAssumedOrOfOtherProportionsIsSaidAndRecorded) {
  const auto camera = [&](int width, int height) {
    const fs::path path = folder_ / fmt::format("{}x{}.json", width, height);
    write_camera(path, Camera::from_fov(width, height, 60));
    return path;
  };
  const auto fact = [&](const fs::path& file) {
    const fs::path out = folder_ / "out";
    Words words = taken_apart(photo(), out);
    words.insert(words.end(), {"--only", "normal"});
    if (!file.empty()) words.insert(words.end(), {"--camera", file});
    EXPECT_EQ(start(words), 0) << said();
    const std::string text = record(out / "provenance.json")["facts"]["camera"];
    EXPECT_THAT(said(), HasSubstr(text));
    EXPECT_THAT(text_of(out / "report.html"), HasSubstr((file.empty() ? view_ : file).filename().string()));
    return text;
  };
  EXPECT_THAT(fact(camera(640, 360)), AllOf(HasSubstr("640x360"), HasSubstr("64x48"), HasSubstr("other proportions")));
  EXPECT_THAT(fact(camera(640, 480)), Not(HasSubstr("proportions")));
  EXPECT_THAT(fact(camera(655, 491)), Not(HasSubstr("proportions"))) << "4:3 to a pixel's rounding";
  EXPECT_THAT(fact(camera(640, 470)), HasSubstr("proportions"));
  EXPECT_THAT(fact({}), HasSubstr(view_.string())) << "the view's own";

  const fs::path assumed = folder_ / "assumed";
  fs::copy(*made_ / "run", folder_ / "maps");
  fs::remove(folder_ / "maps/camera.json");
  ASSERT_EQ(start({"invert", photo(), "--gbuffer", folder_ / "maps", "--only", "normal", "--out", assumed}), 0)
      << said();
  for (const std::string& text : {said(), text_of(assumed / "provenance.json"), text_of(assumed / "report.html")})
    EXPECT_THAT(text, HasSubstr("65 degrees across the longer side and a level camera are assumed"));
}

TEST_F(RunFolder, AScaleThatNobodyMeasuredIsSaidToBeOne) {
  const fs::path out = folder_ / "predicted";
  ASSERT_EQ(start({"invert", photo(), "--fov", "60", "--light", "image", "--spp", "2", "--out", out}), 0) << said();
  for (const std::string& text : {said(), text_of(out / "report.html")})
    EXPECT_THAT(text, AllOf(HasSubstr("% in generated rooms, by a factor of"), HasSubstr("real photographs"),
                            HasSubstr("--known")));
  const auto put_into = [](const fs::path& run) {
    return Words{"insert", run, "--at", "32,40", "--radius", "0.05", "--light", "image", "--spp", "2"};
  };
  ASSERT_EQ(start(put_into(out)), 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("--radius"), HasSubstr("real photographs"), HasSubstr("--known")));
  EXPECT_THAT(text_of(out / "report.html"), HasSubstr("sizes of objects in metres rest"));
  // What is made from it rests on it too, and knows.
  const Words edit{"edit", out, "--mask", mask(), "--roughness", "0.5", "--light", "image", "--spp", "2"};
  ASSERT_EQ(start(edit), 0) << said();
  ASSERT_EQ(start(put_into(out / "edit")), 0) << said();
  EXPECT_THAT(said(), HasSubstr("--known"));
  // Measured, or given: nothing to warn of.
  ASSERT_EQ(start({"invert", photo(), "--fov", "60", "--light", "image", "--spp", "2", "--known", "32,24,2", "--out",
                   folder_ / "known"}),
            0)
      << said();
  ASSERT_EQ(start(put_into(folder_ / "known")), 0) << said();
  EXPECT_THAT(said(), Not(HasSubstr("--radius")));
  ASSERT_EQ(start(inserted()), 0) << said();
  EXPECT_THAT(said(), Not(HasSubstr("--radius")));
}

TEST(RealScaleOfDepth, IsMeasuredForTheShippedWeights) {
  const fs::path weights = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights/maps.safetensors";
  const std::optional<RealScale> scale = real_scale(weights, file_hash(weights));
  ASSERT_TRUE(scale) << frames_file(weights) << " is of other weights: evaluate --frames";
  EXPECT_GE(scale->frames.size(), 4u);
  EXPECT_FALSE(real_scale(weights, "of other weights"));
  const RealScale three{{{"a", 0.5, 1}, {"b", 1.25, 1}, {"c", 4, 1}}};
  EXPECT_NEAR(three.factor(), 2, 1e-12);
  EXPECT_EQ(three.text(), "a factor of 2.00 on 3 real photographs (0.50 to 4.00 times the measured scale)");
}

// --- One at a time ---------------------------------------------------------------------------------------------------

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

// --- Before the work -------------------------------------------------------------------------------------------------

TEST_F(RunFolder, AnImpossibleOutputIsRefusedBeforeTheDeviceIsAsked) {
  put(folder_ / "file", "");
  fs::create_directories(folder_ / "probe.exr");
  const fs::path below = folder_ / "file" / "below";
  const auto refused = [&](Words words, const std::string& named) {
    words.insert(words.end(), {"--device", "there is no such device"});
    expect_refused(words, named);
    EXPECT_THAT(said(), Not(HasSubstr("no such device")));
  };
  refused(inserted({"--out", below}), "file");
  refused(edited({"--out", below}), "file");
  refused(lit({"--out", below / "probe.exr"}), "file");
  refused(lit({"--out", folder_ / "probe.exr"}), "probe.exr");
  refused(taken_apart(photo(), below), "file");
  refused(inserted({"--out", "/proc"}), "/proc");
  refused(edited({"--out", "/proc/edit"}), "/proc");
  refused(lit({"--out", "/proc/probe.exr"}), "/proc");
}

TEST_F(RunFolder, WhereAResultLiesStandsAloneOnStdout) {
  const fs::path out = folder_ / "out", results = folder_ / "stdout.txt";
  const auto printed = [&](Words words, const Words& more = {}) {
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(start(words, {{}, {}, CLERESTORY_PROGRAM, results}), 0) << said();
    return text_of(results);
  };
  EXPECT_EQ(printed(taken_apart(photo(), out)), out.string() + "\n");
  EXPECT_THAT(said(), HasSubstr("report: ")) << "what is said goes elsewhere";
  EXPECT_EQ(printed(inserted(), {"-q"}), (run() / "composite.png").string() + "\n");
  EXPECT_EQ(said(), "") << "nothing but the result under -q";
  EXPECT_EQ(printed(edited()), (run() / "edit").string() + "\n");
  EXPECT_EQ(printed(lit()), (run() / "light.exr").string() + "\n");
  EXPECT_EQ(printed({"report", run(), "-q"}), (run() / "report.html").string() + "\n");
  // JSON instead, or beside it in a file.
  EXPECT_EQ(nlohmann::json::parse(printed(taken_apart(photo(), out), {"--json"}))["run"], out.string());
  EXPECT_GT(nlohmann::json::parse(printed(inserted(), {"--json"}))["figures"]["seconds"], 0);
  EXPECT_EQ(printed(inserted(), {"--json=" + (folder_ / "insert.json").string()}),
            (run() / "composite.png").string() + "\n");
  EXPECT_EQ(record(folder_ / "insert.json")["composite"], (run() / "composite.exr").string());
}

TEST_F(RunFolder, MissingPiecesAreNamed) {
  const fs::path lacking = folder_ / "lacking";
  fs::copy(run(), lacking);
  fs::remove(lacking / "depth.exr"), fs::remove(lacking / "albedo.exr");
  for (Words words : {inserted(), edited(), lit()}) {
    words[1] = lacking;
    expect_refused(words, "the run has no albedo.exr, no depth.exr");
    EXPECT_THAT(said(), AllOf(HasSubstr("without --only"), Not(HasSubstr("0x0"))));
    words[1] = photo();
    expect_refused(words, "a file is no run; `clerestory invert` makes one");
    words[1] = view_.parent_path();
    expect_refused(words, "is no run: it has no camera.json");
  }
  fs::remove(lacking / "provenance.json");
  expect_refused({"report", lacking}, "is no run: it has no provenance.json");
  expect_refused({"evaluate", run()}, "which view is this run of?");
}

// None of these waits for nets or lamps: a device that does not exist is never asked.
TEST_F(RunFolder, MistakesAreFoundBeforeTheWork) {
  fs::create_directory(folder_ / "no weights");
  put(folder_ / "file", "");
  const auto refused = [&](Words words, const std::string& because) {
    words.insert(words.end(), {"--device", "there is no such device"});
    expect_refused(words, because);
  };
  const auto objects = [&](const Words& words) {
    Words all{"insert", run(), "--light", "image"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  refused(objects({"--at", "32,40", "--mesh", "nothere.glb", "--size", "0.1"}), "nothere.glb: cannot be opened");
  refused(objects({"--at", "99,40", "--radius", "0.1"}), "outside of the picture");
  refused(objects({"--at", "32,40", "--radius", "-1"}), "not a length");
  refused(objects({"--at", "32,40", "--radius", "99"}), "larger than the room");
  refused(objects({"--at-point", "0,0,1", "--radius", "0.1"}), "behind the camera");
  refused(objects({"--at", "32,40", "--radius", "0.1", "--spp", "1"}), "two samples");
  const auto photographed = [&](const Words& words) {
    Words all{"invert", photo(), "--out", folder_ / "out"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  };
  refused(photographed({"--known", "99,5,2"}),
          "--known: the point lies outside of the picture (found 99,5, expected 0..63,0..47)");
  refused(photographed({"--known", "5,5,-2"}), "not a distance");
  refused(photographed({"--light-weights", folder_ / "no weights"}), "this folder has no weights of the light");
  refused(photographed({"--light-weights", folder_ / "nothere"}), "there is no such file or folder");
  refused({"invert", photo(), "--out", photo()}, "a file stands where a folder should be");
}

TEST_F(RunFolder, AnInsertionThatWasChangedByHandIsNotReplaced) {
  EXPECT_EQ(start(inserted()), 0) << said();
  put(run() / "composite.png", "painted over by hand");
  expect_refused(inserted(), "composite.png");
  EXPECT_THAT(said(), Not(HasSubstr("composite.exr"))) << "that is as it was written";
  EXPECT_EQ(text_of(run() / "composite.png"), "painted over by hand");
}

TEST_F(RunFolder, NothingStaysOfAFolderForResultsThatNeverCame) {
  expect_refused(inserted({"--at", "640,0", "--radius", "0.1", "--out", folder_ / "new"}), "outside of the picture");
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(RunFolder, TheLensThatExifTellsIsTakenAndSaid) {
  const fs::path photograph = fs::path(CLERESTORY_TEST_DATA) / "io/exif_28mm.jpg";  // 64 x 48
  const auto inverted = [&](const Words& more) {
    Words words{"invert", photograph, "--only", "normal", "--force", "--out", folder_ / "new"};
    words.insert(words.end(), more.begin(), more.end());
    return start(words);
  };
  EXPECT_EQ(inverted({}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("camera: 63.4 degrees across"));  // 2 atan(64 / 2 / (28 * 80 / 43.27))
  EXPECT_NEAR(read_camera(folder_ / "new/camera.json").camera.fov_degrees(), 63.4, 0.05);
  EXPECT_EQ(inverted({"--fov", "50"}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("camera: --fov 50"));
}

TEST_F(RunFolder, SamplesAreRefusedBeforeTheWork) {
  Words words = taken_apart(photo(), folder_ / "new");
  *(std::ranges::find(words, std::string("--spp")) + 1) = "1";
  expect_refused(words, "spp");
  EXPECT_THAT(said(), Not(HasSubstr("camera:"))) << "nothing was read";
}

TEST_F(RunFolder, AnErrorIsAskedForAndRecorded) {
  const fs::path out = folder_ / "new";
  Words words = taken_apart(photo(), out);
  const auto spp = std::ranges::find(words, std::string("--spp"));
  words.erase(spp, spp + 2);
  Words bad = words;
  bad.insert(bad.end(), {"--target-error", "0"});
  expect_refused(bad, "--target-error");
  bad.back() = "0.1", bad.insert(bad.end(), {"--spp", "20"});
  expect_refused(bad, "--spp");
  bad = words, bad.insert(bad.end(), {"--seconds", "5", "--only", "depth"});
  expect_refused(bad, "--only");
  words.insert(words.end(), {"--target-error", "0.2"});
  ASSERT_EQ(start(words), 0) << said();
  EXPECT_THAT(said(), HasSubstr("(asked: 0.2)"));
  const auto provenance = record(out / "provenance.json");
  EXPECT_LE(provenance["figures"]["root relMSE, measured"].get<double>(), 0.2);
  EXPECT_GE(provenance["figures"]["samples a pixel"].get<double>(), 32);
  EXPECT_THAT(text_of(out / "plan.txt"), HasSubstr("re-render: 16 samples a pixel"));
  EXPECT_THAT(text_of(out / "report.html"), HasSubstr("root relMSE"));
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

// --- Interrupted -----------------------------------------------------------------------------------------------------

struct RunFolderInterrupted : RunFolder, testing::WithParamInterface<int> {
  /// Starts work that takes minutes, sends the signal once rays are traced; nothing that was there has changed and
  /// nothing is left.
  void stop(Words words) const {
    words.insert(words.end(), {"--spp", "100000"});
    put(said_, "");
    const std::vector<std::string> before = files_below(folder_.path());
    Program program(words, said_);
    ASSERT_TRUE(wait_until([&] { return said().find("chunks of rays") != std::string::npos; })) << said();
    program.signal(GetParam());
    EXPECT_EQ(program.wait(), kInterrupted) << said();
    EXPECT_THAT(said(), HasSubstr("interrupted"));
    EXPECT_THAT(said(), Not(HasSubstr("goes on from here"))) << "it begins again";
    EXPECT_EQ(files_below(folder_.path()), before) << words[0];
  }
  static Words without_spp(Words words) {
    const auto spp = std::ranges::find(words, "--spp");
    words.erase(spp, spp + 2);
    return words;
  }
};

TEST_P(RunFolderInterrupted, LeavesNothingAndEndsWithFour) {
  stop(without_spp(taken_apart(photo(), run())));
  stop(without_spp(inserted()));
  stop(without_spp(inserted({"--out", run()})));
  stop(without_spp(edited()));
}

// What nohup starts goes on when its terminal is gone, and so does what writes to a reader that left.
TEST_F(RunFolder, NoTerminalAndNoReaderAreNeeded) {
  std::string command = "trap '' HUP; { ";
  for (const std::string& word : Words{CLERESTORY_PROGRAM, "invert", photo(), "--gbuffer", view_, "--light", "image",
                                       "--spp", "2", "--out", folder_ / "new"})
    command += "'" + word + "' ";
  EXPECT_EQ(std::system((command + "2>&1 & pid=$!; sleep 0.2; kill -HUP $pid; wait $pid; } | true").c_str()), 0);
  EXPECT_TRUE(fs::exists(folder_ / "new/rerender.exr"));
  EXPECT_FALSE(fs::exists(folder_ / ".new.partial"));
}

// LLVM, which builds kernels in the process, deletes the files of a build on a signal that reaches it.
TEST_P(RunFolderInterrupted, WhileKernelsAreBuilt) {
  const fs::path cache = folder_ / "kernels";
  fs::create_directory(cache);
  Program program(taken_apart(photo(), folder_ / "new"), said_, {{}, {{"POCL_CACHE_DIR", cache}}});
  ASSERT_TRUE(wait_until([&] {
    return std::ranges::any_of(files_below(cache), [](const std::string& f) { return f.ends_with(".tmp"); });
  }));
  program.signal(GetParam());
  EXPECT_EQ(program.wait(), kInterrupted) << said();
  EXPECT_FALSE(fs::exists(folder_ / "new") || fs::exists(folder_ / ".new.lock") ||
               fs::exists(folder_ / ".new.partial"));
}

INSTANTIATE_TEST_SUITE_P(Signals, RunFolderInterrupted, testing::Values(SIGINT, SIGTERM, SIGHUP));

}  // namespace
}  // namespace clerestory
