// Line plots and dot plots as SVG, drawn by gnuplot.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace clerestory {

enum class Stroke { Line, LinePoints, Points, Dashed };

struct Series {
  std::string label;          // in the key; empty: not in the key
  std::vector<double> x, y;   // equal lengths; points with NaN leave a gap
  std::vector<double> error;  // half length of the error bar of each point; or empty
  Stroke stroke = Stroke::Line;
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;
  std::optional<std::pair<double, double>> x_range, y_range;
  std::vector<Series> series;
  int width = 640, height = 360;  // of the SVG's view box
};

/// Whether gnuplot is there to draw. Where it is not, plots are left out, which is said once.
bool can_plot();
/// What stands where a plot would.
std::string left_out_plot(const Plot& plot);

/// Throws ErrorKind::Failed when gnuplot is missing or complains, ErrorKind::Usage on series of unequal lengths or
/// with nothing to draw. Points a log axis cannot show (<= 0) are left out.
std::string plot_svg(const Plot& plot);
/// plot_svg() into a file. Without gnuplot there is none, not even one drawn before of other data; false.
bool write_plot(const std::filesystem::path& path, const Plot& plot);

/// A number by name.
struct Dot {
  std::string label;
  double value = 0, error = 0;  // half length of the bar; 0: none
};

/// Dots with their error bars, one row each, the first on top.
struct DotPlot {
  std::string title, x_label;
  bool log_x = false;
  std::vector<Dot> dots;  // a value that cannot be drawn leaves its row empty
  int width = 760;
};

/// Throws what plot_svg(Plot) throws.
std::string plot_svg(const DotPlot& plot);

}  // namespace clerestory
