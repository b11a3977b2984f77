// What a run says and records of itself: its light, its camera, its scale, its error, its report.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "experiments/applications/run_folder.hpp"
#include "host/io/camera_file.hpp"
#include "host/io/image.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/run_folder.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/nets/corner.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

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

TEST_F(RunFolder, TheLensThatExifTellsIsTakenAndSaid) {
  const fs::path photograph = fs::path(CLERESTORY_TEST_DATA) / "io/exif_28mm.jpg";  // 64 x 48
  const auto inverted = [&](const Words& more) {
    Words words{"invert", photograph, "--only", "normal", "--force", "--out", folder_ / "new"};
    words.insert(words.end(), more.begin(), more.end());
    return start(words);
  };
  EXPECT_EQ(inverted({}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("camera: 63.4 degrees across"));  // 2 atan(64 / 2 / (28 * 80 / 43.27))
  EXPECT_NEAR(read_camera(folder_ / "new/camera.json").camera.fov_degrees(), 63.4, 0.05);  // in tenths of a degree
  EXPECT_EQ(inverted({"--fov", "50"}), 0) << said();
  EXPECT_THAT(said(), HasSubstr("camera: --fov 50"));
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
  bad = words, bad.push_back("--every-ray");
  expect_refused(bad, "--light net");  // under which alone rays share answers
  words.insert(words.end(), {"--target-error", "0.2"});
  ASSERT_EQ(start(words), 0) << said();
  EXPECT_THAT(said(), HasSubstr("(asked: 0.2)"));
  const auto provenance = record(out / "provenance.json");
  EXPECT_LE(provenance["figures"]["root relMSE, measured"].get<double>(), 0.2);
  EXPECT_GE(provenance["figures"]["samples a pixel"].get<double>(), 32);
  EXPECT_THAT(text_of(out / "plan.txt"), HasSubstr("re-render: 16 samples a pixel"));
  EXPECT_THAT(text_of(out / "report.html"), HasSubstr("root relMSE"));
}

TEST_F(RunFolder, AsManySamplesAreRecordedAsWereTaken) {
  Words words = inserted();
  words.back() = "70";  // four passes
  ASSERT_EQ(start(words), 0) << said();
  EXPECT_EQ(record(run() / "insert.json")["facts"]["samples"], "72 a pixel, guided, sobol");
  words = taken_apart(photo(), folder_ / "grid");
  const auto spp = std::ranges::find(words, std::string("--spp"));
  words.erase(spp, spp + 2);
  words.insert(words.end(), {"--sampler", "grid8x16"});
  ASSERT_EQ(start(words), 0) << said();
  EXPECT_EQ(record(folder_ / "grid/provenance.json")["facts"]["samples"], "128 a pixel, grid8x16, sobol");
  EXPECT_EQ(record(folder_ / "grid/render.json")["rounds"][0]["spp"], 128);
}

TEST_F(RunFolder, AnErrorIsAskedForOfThePixelsUnderAMask) {
  const fs::path out = folder_ / "new", file = folder_ / "half.png", other = folder_ / "other.png";
  const Image picture = read_image(photo());
  Image half(picture.width, picture.height, 1);
  std::fill_n(half.data.begin(), half.data.size() / 2, 1.0f);
  write_png(file, half, Encoding::Linear);
  write_png(other, Image(picture.width + 1, picture.height, 1, 1), Encoding::Linear);
  Words words = taken_apart(photo(), out), alone = words;
  alone.insert(alone.end(), {"--mask", file});
  expect_refused(alone, "--mask");  // no error is asked for
  const auto spp = std::ranges::find(words, std::string("--spp"));
  words.erase(spp, spp + 2);
  words.insert(words.end(), {"--target-error", "0.2", "--mask", other});
  expect_refused(words, other.string());
  words.back() = file;
  ASSERT_EQ(start(words), 0) << said();
  const auto provenance = record(out / "provenance.json");
  EXPECT_THAT(provenance["facts"]["error of the re-render under the mask"].get<std::string>(),
              HasSubstr("(asked: 0.2)"));
  bool recorded = false;
  for (const auto& input : provenance["inputs"]) recorded |= input["path"].get<std::string>().ends_with("half.png");
  EXPECT_TRUE(recorded);
}

TEST_F(RunFolder, AnErrorOfObjectsAndEditsIsAskedForAndRecorded) {
  const auto until = [](Words words, const Words& more) {
    const auto spp = std::ranges::find(words, std::string("--spp"));
    words.erase(spp, spp + 2);
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  for (const Words& command : {inserted(), edited()}) {
    expect_refused(until(command, {"--target-error", "0"}), "--target-error");
    expect_refused(until(command, {"--seconds", "-1"}), "--seconds");
    expect_refused(until(command, {"--target-error", "0.1", "--spp", "20"}), "--spp");
    expect_refused(until(command, {"--sampler", "grid8x16"}), "--sampler");
  }
  const auto expect_recorded = [&](const Words& words, const fs::path& path, const std::string& of) {
    ASSERT_EQ(start(words), 0) << said();
    EXPECT_THAT(said(), HasSubstr("(asked: 0.3)"));
    const auto made = record(path);
    EXPECT_THAT(made["facts"]["error of " + of].get<std::string>(), HasSubstr("root relMSE"));
    EXPECT_LE(made["figures"]["root relMSE, measured"].get<double>(), 0.3);
    EXPECT_GT(made["figures"]["seconds: rounds of samples"].get<double>(), 0);
    const auto samples = static_cast<int>(made["figures"]["samples a pixel"].get<double>());
    EXPECT_GE(samples, 32);
    EXPECT_EQ(made["facts"]["samples"], fmt::format("{} a pixel, guided, sobol", samples));
  };
  expect_recorded(until(inserted(), {"--target-error", "0.3"}), run() / "insert.json", "the objects");
  expect_recorded(until(edited(), {"--target-error", "0.3"}), run() / "edit/provenance.json", "the edit");
  ASSERT_EQ(start(inserted({"--sampler", "cosine"})), 0) << said();
  EXPECT_EQ(record(run() / "insert.json")["facts"]["samples"], "2 a pixel, cosine, sobol");
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

// Files are written side by side: one that cannot be is not passed over, whichever it is.
TEST(WriteRun, AFileThatCannotBeWrittenIsAnErrorWhicheverItIs) {
  const ScratchFolder folder("clerestory-write-run");
  const Scene scene = corner();
  const Image three(scene.width(), scene.height(), 3, 0.5f), one(scene.width(), scene.height(), 1, 0.5f);
  const auto write = [&](const fs::path& run) { write_run(run, scene, Rerender{three, three, one}); };
  fs::create_directories(folder / "whole");
  write(folder / "whole");
  const std::vector<std::string> names = files_below(folder / "whole");
  EXPECT_EQ(names.size(), 16u);  // camera, photograph, four maps and three of the re-render, and previews of them
  for (const std::string& name : names) {
    const fs::path run = folder / ("without-" + name);
    fs::create_directories(run / name / "in-the-way");
    EXPECT_ANY_THROW(write(run)) << name;
  }
}

}  // namespace
}  // namespace clerestory
