// Monte Carlo beside a fixed grid of directions: what the study's table says of a small room.
#include "experiments/studies/layer_study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "experiments/studies/study.hpp"
#include "tests/experiments/synthetic_views.hpp"

namespace clerestory {
namespace {

Table table_under(const std::string& light) {
  const ScratchFolder folder{"clerestory-layer"};
  const Config config = study_config(
      std::filesystem::path(CLERESTORY_SOURCE_DIR) / "experiments/configs/layer.toml",
      {"run.root=" + folder.path().string(), "data.rooms=1", "data.width=32", "data.height=24", "data.spp=4",
       "study.light=" + light, "study.spp=[16,256]", "study.truth_spp=4096", "study.seeds=2"});
  return study_tables(run_study(config, {"clerestory", "run"})).at("layer");
}

/// Rows: grid, grid with Li's BRDF; ours with 16 and 256 samples and at equal time; the paper's alike.
void expect_table(const Table& table) {
  ASSERT_EQ(table.rows.size(), 8u);
  const auto number = [&](std::size_t row, std::size_t column) {
    return std::get<Measure>(table.rows[row][column]).mean;
  };
  EXPECT_EQ(std::get<std::string>(table.rows[4][0]), "ours, equal time to the grid");
  EXPECT_EQ(std::get<std::string>(table.rows[7][0]), "the paper's, equal time to the grid");
  for (const std::size_t of_16 : {std::size_t{2}, std::size_t{5}}) {
    EXPECT_EQ(number(of_16, 1), 16);
    EXPECT_GT(number(of_16, 2), 4 * number(of_16 + 1, 2)) << "16 times the samples; the truth has 1/16 of its error";
    EXPECT_TRUE(std::holds_alternative<std::monostate>(table.rows[of_16][5])) << "not at equal time";
  }
  for (const std::size_t row : {0, 1, 4, 7}) EXPECT_DOUBLE_EQ(number(row, 5), number(row, 2) / number(4, 2));
  for (const std::size_t row : {4, 7}) EXPECT_GE(number(row, 1), 2);
  // Glossy pixels of one small room are too few to tell.
  EXPECT_GT(number(5, 3), number(2, 3)) << "independent points have more error than Sobol's";
}

TEST(LayerStudy, UnderThePhotograph) {
  const Table table = table_under("image");
  EXPECT_THAT(table.note, testing::HasSubstr("light = image, 2 seeds. Ours: guided, sobol"));
  expect_table(table);
}

TEST(LayerStudy, UnderTheLearnedLight) {
  const Table table = table_under("net");
  EXPECT_THAT(table.note, testing::HasSubstr("light = net, 2 seeds. Ours: vndf_caps, sobol"));
  expect_table(table);
}

}  // namespace
}  // namespace clerestory
