#include "host/report/plot.hpp"

#include <cmath>
#include <cstdlib>
#include <regex>

#include "host/error.hpp"
#include "host/report/child_process.hpp"
#include "tests/report/temporary_folder.hpp"

namespace clerestory {
namespace {

class PlotTest : public InTemporaryFolder {
 protected:
  static Plot example() {
    Plot plot;
    plot.title = "Error & <samples>";
    plot.x_label = "it's `date` $(date)";
    plot.y_label = "relMSE_of_x";
    plot.log_x = plot.log_y = true;
    plot.series = {{"ours", {1, 2, 4, 8}, {1, 0.5, 0.25, 0.125}, {0.1, 0.05, 0.5, 0.01}, Stroke::LinePoints},
                   {"grid", {1, 2, 4, 8}, {1, std::nan(""), -3, 0.9}, {}, Stroke::Dashed}};
    return plot;
  }
};

TEST_F(PlotTest, DrawsWhatItIsGiven) {
  const std::string svg = plot_svg(example());
  for (const char* part : {"<svg", "</svg>", "<title>Error &amp; &lt;samples></title>", "relMSE_of_x", ">ours<",
                           ">grid<", "viewBox=\"0 0 640 360\"", "rgb(  0, 114, 178)", "rgb(213,  94,   0)"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  EXPECT_NE(svg.find("`date` $(date)"), std::string::npos) << "labels are text, never commands";
}

// Where a value is missing the pen is lifted: no line says what nobody measured.
TEST_F(PlotTest, CurvesBreakWhereAPointCannotBeDrawn) {
  const auto strokes = [](std::vector<double> x, std::vector<double> y) {
    Plot plot;
    plot.series = {{"", std::move(x), std::move(y), {}, Stroke::Line}};
    const std::string svg = plot_svg(plot);
    const std::regex moved("M[0-9]");
    return std::distance(std::sregex_iterator(svg.begin(), svg.end(), moved), std::sregex_iterator());
  };
  const auto whole = strokes({1, 2, 4, 5}, {1, 2, 2, 1});
  EXPECT_GT(whole, 0);
  EXPECT_EQ(strokes({1, 2, 3, 4, 5}, {1, 2, std::nan(""), 2, 1}), whole + 1);
}

TEST_F(PlotTest, IsTheSameEveryTime) { EXPECT_EQ(plot_svg(example()), plot_svg(example())); }

TEST_F(PlotTest, LargeSeriesPassThroughThePipes) {
  // More than a pipe holds (64 KiB) in both directions at once.
  Plot plot;
  Series series;
  for (int i = 0; i < 40000; ++i) series.x.push_back(i), series.y.push_back(std::sin(0.001 * i));
  plot.series = {series};
  EXPECT_GT(plot_svg(plot).size(), 100000u);
}

TEST_F(PlotTest, UnfitDataIsRefused) {
  Plot plot = example();
  plot.series[0].y.pop_back();
  EXPECT_THROW(plot_svg(plot), Error);
  plot = example();
  plot.series[0].error.pop_back();
  EXPECT_THROW(plot_svg(plot), Error);
  plot.series = {{"nothing", {0, -1}, {1, 1}, {}, Stroke::Line}};
  EXPECT_THROW(plot_svg(plot), Error) << "a log axis shows neither 0 nor -1";
  plot.series.clear();
  EXPECT_THROW(plot_svg(plot), Error);
}

TEST_F(PlotTest, DotsStandInRowsUnderTheirNames) {
  const DotPlot plot{"Errors", "relMSE", true, {{"ours", 0.1, 0.02}, {"it's `date`", 3, 0}, {"-6 %, none", NAN, 0}}};
  const std::string svg = plot_svg(plot);
  for (const char* part : {"<title>Errors</title>", ">ours<", "`date`", ">-6 %, none<", "relMSE"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  EXPECT_THROW(plot_svg(DotPlot{"Errors", "", true, {{"a", 0, 0}}}), Error) << "a log axis does not show 0";
}

TEST_F(PlotTest, MissingGnuplotIsSaid) {
  const std::string path = getenv("PATH");
  setenv("PATH", folder_.c_str(), 1);
  std::string message;
  try {
    plot_svg(example());
  } catch (const Error& error) {
    message = error.what();
  }
  put(folder_ / "plot.svg", "of other data");
  EXPECT_FALSE(can_plot());
  EXPECT_FALSE(write_plot(folder_ / "plot.svg", example()));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "plot.svg"));
  setenv("PATH", path.c_str(), 1);
  EXPECT_TRUE(can_plot());
  EXPECT_NE(message.find("gnuplot"), std::string::npos) << message;
}

TEST_F(PlotTest, WritesAFile) {
  write_plot(folder_ / "plot.svg", example());
  EXPECT_EQ(text_of(folder_ / "plot.svg"), plot_svg(example()));
}

TEST(ChildProcess, InputOutputStatus) {
  const ChildResult echo = run_child({"cat"}, "one\ntwo");
  EXPECT_EQ(echo.status, 0);
  EXPECT_EQ(echo.out, "one\ntwo");
  const ChildResult shell = run_child({"sh", "-c", "echo out; echo err >&2; exit 3"}, "");
  EXPECT_EQ(shell.status, 3);
  EXPECT_EQ(shell.out, "out\n");
  EXPECT_EQ(shell.errors, "err\n");
  EXPECT_EQ(run_child({"sh", "-c", "kill -9 $$"}, "").status, 128 + 9);
  EXPECT_EQ(run_child({"true"}, std::string(1 << 20, 'x')).status, 0) << "a child that does not read";
  EXPECT_THROW(run_child({"no-such-program-anywhere"}, ""), Error);
}

TEST(ChildProcess, EndsWhereItDoesNotGoOn) {
  int asked = 0;
  EXPECT_EQ(run_child({"sleep", "60"}, "", [&] { return ++asked < 3; }).status, 128 + 9);
  EXPECT_GE(asked, 3);
  EXPECT_EQ(run_child({"sh", "-c", "sleep 0.2; exit 3"}, "", [] { return true; }).status, 3);
}

}  // namespace
}  // namespace clerestory
