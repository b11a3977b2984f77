#include "experiments/studies/run_directory_report.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "experiments/studies/strip.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"
#include "host/report/html.hpp"
#include "host/report/metrics.hpp"
#include "host/report/shared_text.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostPoints = 500;  // of a curve: what the width of a plot can show
constexpr double kManyfold = 20;          // a curve that spans more than this is drawn on a log axis
constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;

std::vector<fs::path> artifacts(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> found;
  if (fs::is_directory(folder / "artifacts"))
    for (const auto& entry : fs::directory_iterator(folder / "artifacts"))
      if (entry.path().filename().string().ends_with(ending)) found.push_back(entry.path());
  std::ranges::sort(found);
  return found;
}

std::string words_of(std::string name) {
  std::ranges::replace(name, '_', ' ');
  return name;
}

std::string state_of(const fs::path& folder, bool finishing) {
  if (finishing || fs::exists(folder / "DONE")) return "done";
  return fs::exists(folder / "FAILED") ? "failed: " + read_file(folder / "FAILED", kMostBytes, true) : "not finished";
}

bool spans_many_magnitudes(const std::vector<Series>& series) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Series& s : series)
    for (double v : s.y)
      if (std::isfinite(v)) least = std::min(least, v), most = std::max(most, v);
  return least > 0 && most > kManyfold * least;
}

/// Curves by the part of their name before the last slash, in order of appearance. What a study finds of rooms
/// (findings.hpp: names with bars) is no curve.
std::vector<Plot> plots_of(const std::vector<MetricRecord>& records) {
  std::vector<Plot> plots;
  for (const std::string& name : metric_names(records)) {
    if (name.find('|') != std::string::npos) continue;
    const auto slash = name.rfind('/');
    const std::string group = slash == std::string::npos ? "metrics" : name.substr(0, slash);
    auto plot = std::ranges::find(plots, group, &Plot::title);
    if (plot == plots.end()) {
      plot = plots.insert(plots.end(), Plot{});
      plot->title = group;
      plot->x_label = "step";
    }
    const Curve curve = thinned(curve_of(records, name), kMostPoints);
    if (std::ranges::any_of(curve.values, [](double v) { return std::isfinite(v); }))
      plot->series.push_back({name.substr(slash + 1), curve.steps, curve.values, {}, Stroke::Line});
  }
  std::erase_if(plots, [](const Plot& plot) { return plot.series.empty(); });
  for (Plot& plot : plots) plot.log_y = spans_many_magnitudes(plot.series);
  return plots;
}

std::vector<Table> tables_in(const fs::path& folder, const Provenance& provenance) {
  std::vector<Table> tables;
  for (const fs::path& path : artifacts(folder, ".table.json"))
    tables.push_back(without_folders(table_from_json(read_file(path, kMostBytes), path.string()), provenance));
  return tables;
}

std::vector<Picture> pictures_in(const fs::path& folder) {
  std::vector<Picture> pictures;
  for (const fs::path& path : artifacts(folder, ".png")) {
    pictures.push_back(picture_file(words_of(path.stem().string()), path));
    pictures.back().columns = strip_labels(path);
  }
  return pictures;
}

/// The first table by name is what the run was made for; then what is to be looked at.
void add_results(HtmlReport& report, const fs::path& folder, const std::vector<Table>& tables) {
  const auto drawings = artifacts(folder, ".svg");
  const auto pictures = pictures_in(folder);
  if (tables.empty() && drawings.empty() && pictures.empty()) return;
  report.section("Results");
  if (!tables.empty()) report.table(tables[0]);
  for (const fs::path& path : drawings) report.drawing(read_file(path, kMostBytes), words_of(path.stem().string()));
  if (!pictures.empty()) report.pictures(pictures);
}

void add_curves(HtmlReport& report, const fs::path& folder) {
  const auto plots = plots_of(read_metrics(folder / "metrics.jsonl"));
  if (plots.empty()) return;
  report.section("Curves");
  for (const Plot& plot : plots) report.plot(plot);
}

void add_tables(HtmlReport& report, const std::vector<Table>& tables) {
  if (tables.size() < 2) return;
  report.section("More tables");
  for (std::size_t i = 1; i < tables.size(); ++i) report.table(tables[i]);
}

void add_origin(HtmlReport& report, const fs::path& folder, const Provenance& provenance) {
  std::vector<std::pair<std::string, std::string>> figures, notes;
  for (const auto& [name, value] : provenance.figures)
    figures.emplace_back(words_of(name), fmt::format("{:.4g}", value));
  for (const auto& [name, value] : provenance.facts)
    notes.emplace_back(words_of(name), without_folders(value, provenance));
  const auto text_of = [&](const char* name, bool allow_empty) {
    return without_folders(read_file(folder / name, kMostBytes, allow_empty), provenance);
  };
  report.section("How it was made").facts(figures).notes(notes);
  report.left_out(provenance.left_out);
  report.details("Configuration", text_of("config.resolved.toml", false));
  if (fs::exists(folder / "log.txt")) report.details("Log", text_of("log.txt", true));
  report.footer(provenance);
}

}  // namespace

bool is_run_directory(const fs::path& folder) { return fs::exists(folder / "config.resolved.toml"); }

void write_run_directory_report(const fs::path& folder, bool finishing) {
  const Provenance provenance = read_provenance(folder / "provenance.json");
  const fs::path whole = fs::weakly_canonical(folder);
  const std::string state = without_folders(state_of(folder, finishing), provenance);
  HtmlReport report(whole.parent_path().filename().string(), whole.filename().string() + ", " + state);
  const std::vector<Table> tables = tables_in(folder, provenance);
  add_results(report, folder, tables);
  add_tables(report, tables);
  add_curves(report, folder);
  add_origin(report, folder, provenance);
  report.write(folder / "report.html");
}

}  // namespace clerestory
