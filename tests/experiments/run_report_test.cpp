// The page of a run, from files that are made up: no device is needed.
#include "experiments/applications/run_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_results.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A grey scene of 4 x 2 pixels, whose first pixel emits and whose second has no depth.
Scene grey_scene() {
  Scene scene;
  scene.camera = Camera::from_fov(4, 2, 60);
  scene.photo = scene.albedo = Image(4, 2, 3, 0.5f);
  scene.normal = Image(4, 2, 3), scene.material = Image(4, 2, 3), scene.depth = Image(4, 2, 1, 2.0f);
  std::fill_n(scene.normal.plane(2), 8, 1.0f);
  scene.material.at(2, 0, 0) = 1, scene.depth.at(0, 0, 1) = 0;
  return scene;
}

struct RunReport : testing::Test {
  RunReport() { write_run(run_, scene_, Rerender{render_, Image(4, 2, 3, 0.1f), Image(4, 2, 1, 0.5f)}); }

  std::string page(const Provenance& provenance) const {
    write_provenance(run_ / kProvenanceName, provenance);
    write_run_report(run_);
    return read_file(run_ / "report.html", std::uint64_t{64} << 20);
  }
  /// Of something made from the run.
  Provenance made(const std::string& fact, const std::string& value) const {
    Provenance record = begin_provenance({"clerestory", "make"});
    record.facts[fact] = value;
    record.inputs = {record_file(run_ / "photo.exr")};
    return record;
  }

  ScratchFolder folder_{"clerestory-run-report"};
  fs::path run_ = folder_.path();
  Scene scene_ = grey_scene();
  Image render_{4, 2, 3, 0.625f};
};

TEST_F(RunReport, MapsThatLackOrDoNotFitAreNamedOrLeftOut) {
  const auto refused = [&](const char* because) {
    EXPECT_THAT(message_of([&] { write_run_report(run_); }, ErrorKind::Usage), HasSubstr(because));
  };
  page(made("what", "this"));
  write_exr(run_ / "material.exr", Image(3, 2, 3));
  refused("material.exr: is of another size than the camera");
  fs::remove(run_ / "material.exr");
  EXPECT_THAT(page(made("what", "this")), Not(HasSubstr("relMSE")));
  Image depth(4, 2, 1, 2.0f);
  depth.data[5] = NAN;
  write_exr(run_ / "depth.exr", depth);
  refused("depth.exr: a value is not finite");
  fs::remove(run_ / "depth.exr");
  write_exr(run_ / "uncertainty.exr", Image(4, 3, 1));
  refused("uncertainty.exr: is of another size than the photograph");
}

TEST_F(RunReport, TheErrorIsThatOfThePixelsThatCount) {
  // 0.125^2 / (0.5^2 + 0.01) = 0.0601; -10 log10(0.125^2) = 18.06. The two that do not count are far off.
  for (int c = 0; c < 3; ++c) render_.at(c, 0, 0) = render_.at(c, 0, 1) = 50;
  EXPECT_EQ(error_against_photograph(scene_, render_), "PSNR 18.1 dB, relMSE 0.060");
  // In any unit: shown, the photograph is at 0.9 and the render at 1.125, cut at 1.
  const Image photo = scene_.photo, render = render_;
  for (const float unit : {1e-4f, 1e4f}) {
    scene_.photo = scaled(photo, unit), render_ = scaled(render, unit);
    EXPECT_EQ(error_against_photograph(scene_, render_), "PSNR 20.0 dB, relMSE 0.062") << unit;
  }
  std::ranges::fill(scene_.depth.data, 0.0f);
  EXPECT_EQ(error_against_photograph(scene_, render_), std::nullopt);
}

TEST_F(RunReport, PicturesComeFirstAndFactsAfter) {
  const std::string text = page(made("light", "net (/home/me/weights)"));
  EXPECT_LT(text.find("class=\"compare\""), text.find("class=\"facts\""));
  EXPECT_LT(text.find(">Maps<"), text.find(">In figures<"));
  EXPECT_THAT(text, AllOf(HasSubstr("PSNR 18.1 dB, relMSE 0.060"), HasSubstr("net (weights)"), HasSubstr("<span>2 m"),
                          Not(HasSubstr("/home/me")), Not(HasSubstr(run_.string()))));
}

TEST_F(RunReport, StagesStandInTheirOrderAboveTheirSum) {
  Provenance record = begin_provenance({"clerestory", "invert"});
  record.figures = {{"seconds: writing", 1},
                    {"seconds: reading", 2},
                    {"seconds: re-render", 8},
                    {"seconds: network", 0.25},
                    {"seconds: re-render, shading", 3},
                    {"seconds: building kernels", 4}};
  const std::string text = page(record);
  std::size_t at = text.find(">Time<");
  for (const char* next : {">reading<", ">nets of the maps<", ">re-render<", "in it: directions and shading",
                           ">writing<", ">together<", ">11.2<", "Building kernels took 4 s of it"}) {
    at = text.find(next, at);
    EXPECT_NE(at, std::string::npos) << next;
  }
}

TEST_F(RunReport, RaysAreToldInSentences) {
  Provenance record = begin_provenance({"clerestory", "invert"});
  record.figures = {{"rays", 2e6}, {"rays that hit", 5e5}, {"samples dropped", 20}};
  EXPECT_THAT(page(record), AllOf(HasSubstr("Of 2.00 million rays"), HasSubstr("25 % end on a surface"),
                                  HasSubstr("not finite: less than 0.01 %."), HasSubstr("faces away: none."),
                                  Not(HasSubstr("learned light"))));
  record.figures["rays answered in view"] = 5e5, record.figures["rays answered out of view"] = 1.8e6;
  EXPECT_THAT(page(record), HasSubstr("asked about 25 % of all rays, the one out of view about 90 %"));
}

TEST_F(RunReport, OnlyWhatWasMadeFromThisPhotographIsShown) {
  const Image picture(4, 2, 3, 0.25f);
  const auto put = [&](const fs::path& folder, const std::string& name, const Provenance& record,
                       const std::string& record_name) {
    fs::create_directories(folder);
    write_exr(folder / name, picture);
    write_provenance(folder / record_name, record);
  };
  Provenance stale = made(kPointFact, "9,9,9");
  stale.inputs[0].hash = "of another photograph";
  put(run_, "probe.exr", made(kPointFact, "1,2,-3"), "probe.json");
  put(run_, "stale.exr", stale, "stale.json");
  put(run_ / "three", "composite.exr", made("light", "image"), kInsertRecord);
  put(run_ / "edit", "photo.exr", made(kEditFact, "roughness 0.7"), kProvenanceName);
  write_exr(run_ / "albedo copy.exr", picture);
  write_file(run_ / "albedo copy.json", "{\"no\": \"record\"}");
  const RunResults found = results_of_run(run_);
  EXPECT_EQ(found.insertions.size(), 1u);
  EXPECT_EQ(found.edits.size(), 1u);
  EXPECT_EQ(found.panoramas.size(), 1u);
  EXPECT_THAT(page(begin_provenance({"clerestory", "invert"})),
              AllOf(HasSubstr("three/composite.exr"), HasSubstr("At 1,2,-3 m"), HasSubstr("roughness 0.7"),
                    HasSubstr("edit/report.html"), Not(HasSubstr("9,9,9"))));
}

TEST_F(RunReport, AnEditHasThePhotographBeforeItWhereThatStillIs) {
  Provenance record = made(kEditFact, "metallic 1");
  write_exr(folder_ / "before.exr", Image(4, 2, 3, 0.75f));
  record.inputs = {record_file(folder_ / "before.exr")};
  EXPECT_THAT(page(record), AllOf(HasSubstr("A material replaced"), HasSubstr("\"Photograph or Edited\"")));
  fs::remove(folder_ / "before.exr");
  EXPECT_THAT(page(record), AllOf(HasSubstr("nothing to compare with"), Not(HasSubstr("\"Photograph or Edited\""))));
}

// "runs/room/", as completion by a shell leaves it, is the run "runs/room".
TEST_F(RunReport, ARunGivenWithASlashIsTheSameRun) {
  Provenance edit = made(kEditFact, "roughness 0.7");
  edit.inputs[0].path = "/moved/away/photo.exr";  // so that the run around the edit is looked at
  const fs::path inside = run_ / "edit";
  fs::create_directory(inside);
  write_run(inside, scene_, std::nullopt);
  write_provenance(inside / kProvenanceName, edit);
  const auto page_of = [](const fs::path& folder) {
    write_run_report(folder);
    return read_file(folder / "report.html", std::uint64_t{64} << 20);
  };
  const std::string of_edit = page_of(inside);
  EXPECT_THAT(of_edit, HasSubstr("\"Photograph or Edited\""));
  EXPECT_EQ(page_of(inside / ""), of_edit);
  const std::string of_run = page(begin_provenance({"clerestory", "invert"}));
  EXPECT_THAT(of_run, HasSubstr("edit/report.html"));
  EXPECT_EQ(page_of(run_ / ""), of_run);
  fs::remove(run_ / "report.html");
  refresh_run_report(run_ / "", inside / "");
  EXPECT_TRUE(fs::exists(run_ / "report.html")) << "a result inside of the run is none of it";
}

}  // namespace
}  // namespace clerestory
