// The studies that put methods side by side, whole, at a size where nothing can be said of the nets, which are
// untrained.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "experiments/studies/run_directory_report.hpp"
#include "experiments/studies/study.hpp"
#include "host/io/image.hpp"
#include "host/report/metrics.hpp"
#include "host/report/progress.hpp"
#include "tests/experiments/program.hpp"
#include "tests/experiments/synthetic_views.hpp"
#include "tests/experiments/untrained_light.hpp"
#include "tests/message_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct SideBySide : testing::Test {
  static void SetUpTestSuite() {
    set_quiet(true);
    made_ = std::make_unique<ScratchFolder>("clerestory-side-by-side");
    write_untrained_li2020(li(), {96, 72});
  }
  static void TearDownTestSuite() { made_.reset(), set_quiet(false); }
  static std::string li() { return (*made_ / "li").string(); }

  static fs::path ran(const std::string& kind, const std::vector<std::string>& more) {
    std::vector<std::string> words{"study.kind=" + kind,
                                   "run.root=" + (*made_ / "runs").string(),
                                   "run.experiment=" + kind,
                                   "data.rooms=2",
                                   "data.width=64",
                                   "data.height=48",
                                   "data.spp=4"};
    words.insert(words.end(), more.begin(), more.end());
    return run_study(Config(study_schema(kind), words), {"clerestory", "run"});
  }
  static std::string refused(const std::string& kind, const std::vector<std::string>& more) {
    return message_of([&] { ran(kind, more); }, ErrorKind::Usage);
  }
  static std::string words_of(const Cell& cell) { return std::get<std::string>(cell); }
  static double number_of(const Cell& cell) { return std::get<Measure>(cell).mean; }
  /// Rows whose first cells are these.
  static std::vector<std::vector<Cell>> rows(const Table& table, const std::vector<std::string>& first) {
    std::vector<std::vector<Cell>> found;
    for (const auto& row : table.rows) {
      bool alike = true;
      for (std::size_t i = 0; i < first.size(); ++i) alike = alike && words_of(row[i]) == first[i];
      if (alike) found.push_back(row);
    }
    return found;
  }
  static inline std::unique_ptr<ScratchFolder> made_;
};

TEST_F(SideBySide, MapsOfAMethodBesideThemselves) {
  const fs::path run = ran("maps", {"maps.weights=" + li() + "/maps.safetensors", "study.rival=" + li()});
  const RunTables tables = study_tables(run);
  const Table& errors = tables.at("1_maps");
  const auto ours = rows(errors, {"Clerestory"}), theirs = rows(errors, {"Li et al. 2020"});
  ASSERT_EQ(ours.size(), 1u);
  ASSERT_EQ(theirs.size(), 1u);
  for (std::size_t c = 1; c < ours[0].size(); ++c) EXPECT_EQ(ours[0][c].index(), theirs[0][c].index()) << c;
  int compared = 0;
  for (const auto& row : tables.at("2_differences").rows)
    if (words_of(row[1]) == "Li et al. 2020") {
      ++compared;
      EXPECT_EQ(number_of(row[2]), 0) << words_of(row[0]);
      EXPECT_EQ(words_of(row[5]), "none") << words_of(row[0]);
    }
  EXPECT_GE(compared, 4) << "albedo, normals, depth, roughness at least";
  EXPECT_THAT(errors.note, Not(HasSubstr("Lacking: Li")));
  const Image sheet = read_image(run / "artifacts/room0_photo_albedo_roughness_metallic_normal_depth.png");
  EXPECT_EQ(sheet.width, 6 * 64);
  EXPECT_EQ(sheet.height, 3 * 48) << "ours, theirs, truth";
}

TEST_F(SideBySide, WithoutARivalItIsSaidToBeLacking) {
  const RunTables tables = study_tables(ran("maps", {"run.variant=alone"}));
  EXPECT_THAT(tables.at("1_maps").note,
              AllOf(HasSubstr("Lacking: Li et al. 2020 (study.rival)"), HasSubstr("InteriorVerse")));
  EXPECT_TRUE(rows(tables.at("1_maps"), {"Li et al. 2020"}).empty());
}

TEST_F(SideBySide, MirrorObjectsUnderEachLight) {
  const fs::path run =
      ran("objects", {"study.method=" + li(), "study.rival=" + li(), "objects.spp=4", "objects.truth_spp=8",
                      "objects.shapes=[ball]", "objects.lights=[net, constant, mirrored]", "data.rooms=3",
                      "data.width=96", "data.height=72"});
  const RunTables tables = study_tables(run);
  const Table& objects = tables.at("1_objects");
  for (const char* maps : {"predicted", "true"}) {
    const auto all = rows(objects, {maps, "ball"});
    ASSERT_EQ(all.size(), 4u) << "three lights and the rival";
    EXPECT_EQ(words_of(all[3][2]), "Li et al. 2020");
    for (std::size_t c = 3; c < 6; ++c)
      EXPECT_EQ(number_of(all[0][c]), number_of(all[3][c]))
          << "the same nets, by the same random numbers: column " << c;
    EXPECT_NE(number_of(all[0][3]), number_of(all[1][3]));
    for (const auto& row : rows(tables.at("2_bar"), {maps, "ball"}))
      EXPECT_THAT(words_of(row[9]), testing::AnyOf("reached", "missed"));
    EXPECT_EQ(rows(tables.at("2_bar"), {maps, "ball"}).size(), 2u) << "learned lights alone";
  }
}

TEST_F(SideBySide, ObjectsSeenByTwoCameras) {
  const fs::path run =
      ran("objects", {"run.variant=two", "objects.baseline=0.1", "objects.spp=2", "objects.truth_spp=4",
                      "objects.shapes=[bunny]", "objects.lights=[constant]", "data.rooms=3"});
  const RunTables tables = study_tables(run);
  const auto all = rows(tables.at("1_objects"), {"predicted", "bunny"});
  ASSERT_EQ(all.size(), 1u);
  EXPECT_TRUE(std::isfinite(number_of(all[0][3])));
  EXPECT_THAT(tables.at("1_objects").note, HasSubstr("a second camera 0.1 m beside the first"));
}

TEST_F(SideBySide, ByTheProtocolOfOthers) {
  const fs::path run =
      ran("protocol", {"maps.weights=" + li() + "/maps.safetensors", "study.rival=" + li(), "data.rooms=2"});
  const RunTables tables = study_tables(run);
  for (const char* data : {"our rooms, as NYUv2", "our rooms, as IIW"}) {
    const auto all = rows(tables.at("1_paper"), {data});
    ASSERT_EQ(all.size(), 4u) << "ours, the rival, simple methods, one value";
    for (std::size_t c = 2; c < all[0].size(); ++c)
      if (all[0][c].index() > 0) {
        EXPECT_EQ(number_of(all[0][c]), number_of(all[1][c])) << data << c;
      }
  }
  EXPECT_EQ(tables.at("2_rooms").rows.size(), 4u);
  EXPECT_THAT(tables.at("1_paper").note,
              AllOf(HasSubstr("NYUv2 (protocol.nyu)"), HasSubstr("IIW (protocol.iiw)"), HasSubstr("Wang et al. 2021")));
}

TEST_F(SideBySide, RefuseWhatIsNotThere) {
  for (const char* kind : {"maps", "objects", "protocol"}) {
    EXPECT_THAT(refused(kind, {"run.variant=never", "study.rival=li2021"}),
                AllOf(HasSubstr("study.rival"), HasSubstr("li2021"), HasSubstr("zhu, li2020 or a folder")));
    EXPECT_THAT(refused(kind, {"run.variant=never", "study.rival=" + made_->path().string()}),
                HasSubstr("the folder of a method lacks weights"));
  }
  EXPECT_THAT(refused("objects", {"run.variant=never", "objects.shapes=[ball, teapot]"}),
              AllOf(HasSubstr("objects.shapes"), HasSubstr("teapot"), HasSubstr("ball, bunny, suzi")));
  EXPECT_THAT(refused("objects", {"run.variant=never", "objects.lights=[moon]"}), HasSubstr("moon"));
  EXPECT_THAT(refused("protocol", {"run.variant=never", "protocol.nyu=" + made_->path().string()}),
              HasSubstr("protocol.nyu"));
}

}  // namespace
}  // namespace clerestory
