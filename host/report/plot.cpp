// Plots: a script for gnuplot, its SVG back.
#include "host/report/plot.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/child_process.hpp"
#include "host/report/progress.hpp"

namespace clerestory {
namespace {

// Told apart by people with any kind of colour vision: Okabe and Ito, "Color Universal Design", 2008.
constexpr const char* kColours[] = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"};
constexpr const char* kInk = "#5b6066";  // html_page.cpp lets these two follow the page's colours
constexpr const char* kGrid = "#d9dadc";
constexpr double kLeastOfBar = 1e-3;  // of its value, where a bar on a log axis would reach below zero

/// Single-quoted: gnuplot expands nothing in it, no escapes and no commands.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (char c : text) {
    if (c == '\'') out += "'";
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "'";
}

bool drawable(const Plot& plot, double x, double y) {
  return std::isfinite(x) && std::isfinite(y) && (!plot.log_x || x > 0) && (!plot.log_y || y > 0);
}

/// One data block: x y low high; an empty line breaks the curve where a point cannot be drawn.
std::string data_block(const Plot& plot, const Series& series, std::size_t& drawn) {
  std::string text;
  bool gap = true;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const double x = series.x[i], y = series.y[i];
    if (!drawable(plot, x, y)) {
      if (!gap) text += "\n";
      gap = true;
      continue;
    }
    const double e = series.error.empty() || !std::isfinite(series.error[i]) ? 0 : series.error[i];
    // On a log axis the lower end may lie beyond zero: the bar then goes far down, but stays a number.
    const double low = plot.log_y ? std::max(y - e, y * kLeastOfBar) : y - e;
    text += fmt::format("{} {} {} {}\n", x, y, low, y + e);
    gap = false;
    ++drawn;
  }
  return text;
}

std::string series_command(const Series& series, std::size_t index) {
  const std::string colour = kColours[index % std::size(kColours)];
  const std::string data = fmt::format("$data{}", index);
  const std::string title = series.label.empty() ? "notitle" : "title " + quoted(series.label);
  std::string text;
  if (!series.error.empty())
    text += fmt::format("{} using 1:3:(0):($4-$3) with vectors nohead linewidth 1 linecolor rgb '{}' notitle, ", data,
                        colour);
  switch (series.stroke) {
    case Stroke::Line:
      return text + fmt::format("{} with lines linewidth 1.8 linecolor rgb '{}' {}", data, colour, title);
    case Stroke::Dashed:
      return text +
             fmt::format("{} with lines linewidth 1.4 dashtype (6,4) linecolor rgb '{}' {}", data, colour, title);
    case Stroke::LinePoints:
      return text + fmt::format("{} with linespoints linewidth 1.6 pointtype 7 pointsize 0.5 linecolor rgb '{}' {}",
                                data, colour, title);
    case Stroke::Points:
      return text + fmt::format("{} with points pointtype 7 pointsize 0.5 linecolor rgb '{}' {}", data, colour, title);
  }
  return text;
}

std::string range_command(const char* axis, const std::optional<std::pair<double, double>>& range) {
  return range ? fmt::format("set {}range [{}:{}]\n", axis, range->first, range->second) : "";
}

/// What all plots have; `grid`: the axis whose tics have lines across the picture.
std::string style_commands(const std::string& title, int width, int height, const char* grid) {
  std::string script = fmt::format(
      "set terminal svg noenhanced dynamic size {},{} font 'sans-serif,12' linewidth 1\n"
      "set encoding utf8\n"
      "set border 3 linewidth 0.8 linecolor rgb '{}'\n"
      "set tics nomirror out scale 0.5 textcolor rgb '{}'\n"
      "set grid {}tics linewidth 0.6 linetype 1 linecolor rgb '{}'\n"
      "set rmargin 3\n",
      width, height, kInk, kInk, grid, kGrid);
  if (!title.empty()) script += fmt::format("set title {} textcolor rgb '{}'\n", quoted(title), kInk);
  return script;
}

std::string script_of(const Plot& plot) {
  std::string script = style_commands(plot.title, plot.width, plot.height, "y");
  script += fmt::format("set key top right samplen 2 spacing 1.2 textcolor rgb '{}' noenhanced\n", kInk);
  script += fmt::format("set xlabel {} textcolor rgb '{}'\nset ylabel {} textcolor rgb '{}'\n", quoted(plot.x_label),
                        kInk, quoted(plot.y_label), kInk);
  if (plot.log_x) script += "set logscale x\n";
  if (plot.log_y) script += "set logscale y\n";
  script += range_command("x", plot.x_range) + range_command("y", plot.y_range);

  std::size_t drawn = 0;
  std::string commands;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    if (series.x.size() != series.y.size() || (!series.error.empty() && series.error.size() != series.y.size()))
      throw usage_error("series of unequal lengths", "plot " + plot.title + ", " + series.label,
                        fmt::format("{} x, {} y, {} errors", series.x.size(), series.y.size(), series.error.size()));
    const std::size_t before = drawn;
    const std::string data = data_block(plot, series, drawn);
    if (drawn == before) continue;  // gnuplot refuses an empty block
    script += fmt::format("$data{} << END_OF_DATA\n{}END_OF_DATA\n", i, data);
    commands += (commands.empty() ? "plot " : ", ") + series_command(series, i);
  }
  if (drawn == 0) throw usage_error("nothing to draw", "plot " + plot.title);
  return script + commands + "\n";
}

/// A tic's name is a format to gnuplot.
std::string quoted_tic(const std::string& text) {
  std::string format;
  for (const char c : text) format.append(c == '%' ? 2 : 1, c);
  return quoted(std::as_const(format));  // std::quoted would take another
}

constexpr int kRowHeight = 20, kAroundRows = 90;  // pixels: of a row of a dot plot, and of title and axis

std::string script_of(const DotPlot& plot) {
  std::string rows, data;
  for (std::size_t i = 0; i < plot.dots.size(); ++i) {
    const auto& [label, value, error] = plot.dots[i];
    rows += fmt::format("{}{} {}", i ? ", " : "", quoted_tic(label), i);
    if (!std::isfinite(value) || (plot.log_x && value <= 0)) continue;
    const double e = std::isfinite(error) ? error : 0;
    const double low = plot.log_x ? std::max(value - e, value * kLeastOfBar) : value - e;
    data += fmt::format("{} {} {} {}\n", value, i, low, value + e);
  }
  if (data.empty()) throw usage_error("nothing to draw", "plot " + plot.title);
  const auto count = static_cast<int>(plot.dots.size());
  std::string script = style_commands({}, plot.width, kAroundRows + kRowHeight * count, "y");
  // A title would stand over the axis, which names of rows push to the right, and be cut off.
  script += fmt::format("set tmargin 3\nset label {} at screen 0.02, screen 1 left offset 0,-1.2 textcolor rgb '{}'\n",
                        quoted(plot.title), kInk);
  script += fmt::format("set grid xtics\nset xlabel {} textcolor rgb '{}'\n", quoted(plot.x_label), kInk);
  if (plot.log_x) script += "set logscale x\n";
  script += fmt::format("set ytics ({})\nset yrange [{}:-0.5]\nset offsets graph 0.03, graph 0.03, 0, 0\n", rows,
                        count - 0.5);
  script += fmt::format("$data << END_OF_DATA\n{}END_OF_DATA\nplot ", data);
  script += fmt::format("$data using 3:2:($4-$3):(0) with vectors nohead linewidth 1.4 linecolor rgb '{}' notitle, ",
                        kColours[0]);
  return script +
         fmt::format("$data using 1:2 with points pointtype 7 pointsize 0.6 linecolor rgb '{}' notitle\n", kColours[0]);
}

/// gnuplot titles every picture "Gnuplot", which browsers show as a hint: put our title there.
std::string with_own_title(std::string svg, const std::string& title) {
  const auto from = svg.find("<title>"), to = svg.find("</title>");
  if (from == std::string::npos || to == std::string::npos) return svg;
  std::string escaped;
  for (char c : title) escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return svg.replace(from + 7, to - from - 7, escaped);
}

std::string drawn(const std::string& script, const std::string& title) {
  const ChildResult result = run_child({"gnuplot", "-"}, script);
  if (result.status != 0 || result.out.find("</svg>") == std::string::npos)
    throw Error(ErrorKind::Failed, "gnuplot failed: " + result.errors, "plot " + title,
                fmt::format("exit status {}", result.status));
  return with_own_title(result.out, title);
}

}  // namespace

std::string plot_svg(const Plot& plot) { return drawn(script_of(plot), plot.title); }

std::string plot_svg(const DotPlot& plot) { return drawn(script_of(plot), plot.title); }

bool can_plot() {
  if (is_program("gnuplot")) return true;
  static const bool said = [] {
    say("gnuplot is not installed: plots are left out");
    return true;
  }();
  return !said;
}

std::string left_out_plot(const Plot& plot) {
  return fmt::format("The plot \u201c{}\u201d is left out: gnuplot is not installed.", plot.title);
}

bool write_plot(const std::filesystem::path& path, const Plot& plot) {
  if (can_plot()) {
    write_file(path, plot_svg(plot));
    return true;
  }
  std::filesystem::remove(path);
  return false;
}

}  // namespace clerestory
