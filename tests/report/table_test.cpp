#include "host/report/table.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"

namespace clerestory {
namespace {

Table example() {
  Table table{"Layer study", {{"sampler", ""}, {"relMSE", "", Best::Lowest}, {"PSNR", "dB", Best::Highest}}, {}};
  table.add({std::string("grid|8x16"), Measure{0.01234, 0.00042, 5}, Measure{24.1, 0.32, 5}});
  table.add({std::string("ours"), Measure{0.00317, 0.00008, 5}, Measure{31.6, 0.21, 5}});
  table.add({std::string("broken"), Measure{std::nan(""), 0, 5}, {}});
  return table;
}

TEST(TableTest, MeanAndDeviationOfSamples) {
  const Measure m = measure_of({1, 2, 3, 4});
  EXPECT_EQ(m.mean, 2.5);
  // Variance with n - 1: (2.25 + 0.25 + 0.25 + 2.25) / 3 = 5/3; one square root, so one rounding.
  EXPECT_DOUBLE_EQ(m.deviation, std::sqrt(5.0 / 3));
  EXPECT_EQ(m.count, 4);
  EXPECT_EQ(measure_of({3}).deviation, 0);
  EXPECT_THROW(measure_of({}), Error);
}

TEST(TableTest, ANoteStandsBelowTheTitle) {
  Table table = example();
  EXPECT_EQ(table_json(table).find("note"), std::string::npos);
  table.note = "Clamp 1; spread over 5 seeds.";
  EXPECT_EQ(table_markdown(table).find("**Layer study**\n\nClamp 1; spread over 5 seeds.\n\n| sampler |"), 0u);
  EXPECT_EQ(table_text(table).find("Layer study\nClamp 1; spread over 5 seeds.\nsampler"), 0u);
  EXPECT_EQ(table_from_json(table_json(table), "t").note, table.note);
}

TEST(TableTest, CellsAsText) {
  const Column column{"x"};
  EXPECT_EQ(cell_text({}, column), "-");
  EXPECT_EQ(cell_text(std::string("a"), column), "a");
  EXPECT_EQ(cell_text(Measure{0.012345, 0, 1}, column), "0.0123");
  EXPECT_EQ(cell_text(Measure{0.012345, 0.00042, 5}, column), "0.0123 ± 0.0004");
  EXPECT_EQ(cell_text(Measure{24.1, 0.32, 5}, column), "24.1 ± 0.3");
  EXPECT_EQ(cell_text(Measure{1024, 0, 1}, column), "1024") << "whole numbers stay whole";
  EXPECT_EQ(cell_text(Measure{24.1, 0.001, 5}, column), "24.1 ± 0.001") << "a deviation never rounds to nothing";
  EXPECT_EQ(cell_text(Measure{1, 0.25, 5}, column), "1.00 ± 0.25") << "measured numbers show their digits";
  EXPECT_EQ(cell_text(Measure{12345.6, 78.9, 5}, column), "12346 ± 79");
  EXPECT_EQ(cell_text(Measure{123, 1, 5}, column), "123 ± 1");
  EXPECT_EQ(cell_text(Measure{1.5e-7, 2e-9, 3}, column), "1.50e-07 ± 2.0e-09");
}

TEST(TableTest, BestFollowsTheDirectionAndIgnoresNan) {
  const Table table = example();
  EXPECT_FALSE(is_best(table, 0, 1));
  EXPECT_TRUE(is_best(table, 1, 1));
  EXPECT_FALSE(is_best(table, 2, 1)) << "NaN is never best";
  EXPECT_TRUE(is_best(table, 1, 2));
  EXPECT_FALSE(is_best(table, 0, 0)) << "words have no best";
  Table ties{"", {{"x", "", Best::Lowest}}, {{Measure{1}}, {Measure{1}}, {Measure{2}}}};
  EXPECT_TRUE(is_best(ties, 0, 0) && is_best(ties, 1, 0));
  EXPECT_FALSE(is_best(ties, 2, 0));
}

TEST(TableTest, TextIsAligned) {
  EXPECT_EQ(table_text(example()),
            "Layer study\n"
            "sampler                 relMSE     PSNR [dB]\n"
            "grid|8x16    0.0123 ± 0.0004    24.1 ± 0.3\n"
            "ours       0.00317 ± 0.00008 *  31.6 ± 0.2 *\n"
            "broken                   nan             -\n");
}

TEST(TableTest, MarkdownEscapesAndSetsBold) {
  const std::string text = table_markdown(example());
  EXPECT_NE(text.find("**Layer study**\n\n| sampler | relMSE | PSNR [dB] |\n|---|---:|---:|\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("| grid\\|8x16 | 0.0123"), std::string::npos) << text;
  EXPECT_NE(text.find("**31.6 ± 0.2**"), std::string::npos) << text;
  Table log{"", {{"fault", ""}}, {}};
  log.add({std::string("two\r\nlines")});
  EXPECT_EQ(table_markdown(log), "| fault |\n|---|\n| two  lines |\n");
}

TEST(TableTest, JsonRoundTrip) {
  const Table table = example();
  const Table back = table_from_json(table_json(table), "test");
  EXPECT_EQ(table_json(back), table_json(table));
  EXPECT_EQ(table_text(back), table_text(table));
  EXPECT_EQ(std::get<Measure>(back.rows[1][1]).mean, 0.00317);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(back.rows[2][2]));
  EXPECT_THROW(table_from_json("{", "test"), Error);
  EXPECT_THROW(table_from_json("{\"title\": 3}", "test"), Error);
  EXPECT_THROW(table_from_json(R"({"title":"","columns":[],"rows":[["too long"]]})", "test"), Error);
}

TEST(TableTest, RowsHaveTheRightLength) {
  Table table = example();
  EXPECT_THROW(table.add({Measure{1}}), Error);
}

}  // namespace
}  // namespace clerestory
