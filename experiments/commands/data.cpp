#include "experiments/commands/data.hpp"

#include <algorithm>
#include <cstdio>

#include "experiments/evaluation/data_check.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/report/html.hpp"
#include "host/report/progress.hpp"
#include "host/report/terminal.hpp"
#include "tracer/named_set.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kShownProblems = 20;

struct DataArguments {
  std::vector<std::string> folders;
  std::filesystem::path report, manifest;
  int views = 0;
};

Table folders_table(const std::vector<DataCheck>& checks) {
  Table table;
  table.title = "Rooms and views";
  for (const char* name :
       {"folder", "rooms", "views", "usable", "size", "valid pixels", "with camera", "with emission", "problems"})
    table.columns.push_back({name, std::string_view(name) == "valid pixels" ? "%" : "", Best::None, 3});
  for (const DataCheck& c : checks) {
    const std::string least = fmt::format("{}x{}", c.least_width, c.least_height),
                      most = fmt::format("{}x{}", c.most_width, c.most_height);
    const auto number = [](auto n) { return Cell(fmt::format("{}", n)); };
    const double percent = 100 * static_cast<double>(c.valid) / static_cast<double>(c.pixels);
    const Cell valid = c.pixels > 0 ? Cell(Measure{percent}) : Cell();
    table.add({c.folder.string(), number(c.rooms), number(c.views), number(c.usable),
               least == most ? least : least + " to " + most, valid, number(c.with_camera), number(c.with_emission),
               number(c.problems.size())});
  }
  return table;
}

Table quantities_table(const std::vector<DataCheck>& checks) {
  Table table;
  table.title = "Pixels: 10th, 50th and 90th percentile";
  table.note = "Steps are between a valid pixel and its right neighbour. That of depth is of its logarithm.";
  for (const char* name : {"quantity", "folder", "10 %", "50 %", "90 %"}) table.columns.push_back({name});
  for (int q = 0; q < kMapQuantities; ++q) {
    const MapQuantityInfo& what = info(static_cast<MapQuantity>(q));
    const std::string name = *what.unit ? fmt::format("{} ({})", what.name, what.unit) : what.name;
    for (const DataCheck& c : checks) {
      std::vector<Cell> row{name, c.folder.string()};
      for (const double part : {0.1, 0.5, 0.9}) {
        const Histogram& histogram = c.histograms[static_cast<std::size_t>(q)];
        row.push_back(histogram.count() > 0 ? Cell(Measure{histogram.quantile(part)}) : Cell());
      }
      table.add(std::move(row));
    }
  }
  return table;
}

std::vector<Plot> plots(const std::vector<DataCheck>& checks) {
  constexpr int bins = 60;
  std::vector<Plot> all;
  for (int q = 0; q < kMapQuantities; ++q) {
    const MapQuantityInfo& what = info(static_cast<MapQuantity>(q));
    Plot plot;
    plot.title = what.name, plot.x_label = what.unit, plot.y_label = "share of pixels", plot.log_x = what.logarithmic;
    for (const DataCheck& c : checks) {
      const Histogram::Shares shares = c.histograms[static_cast<std::size_t>(q)].shares(bins);
      const std::string label = checks.size() > 1 ? c.folder.string() : "";
      plot.series.push_back({.label = label, .x = shares.at, .y = shares.share, .error = {}});
    }
    all.push_back(std::move(plot));
  }
  return all;
}

std::string problems_text(const std::vector<DataCheck>& checks) {
  std::string text;
  for (const DataCheck& c : checks) {
    for (std::size_t i = 0; i < std::min(c.problems.size(), kShownProblems); ++i)
      text += fmt::format("{}: {}\n", c.problems[i].file, c.problems[i].what);
    if (c.problems.size() > kShownProblems)
      text += fmt::format("{}: {} further problems (--json names all)\n", c.folder.string(),
                          c.problems.size() - kShownProblems);
  }
  return text;
}

std::string data_json(const std::vector<DataCheck>& checks) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const DataCheck& c : checks) {
    nlohmann::ordered_json one{{"folder", c.folder.string()},
                               {"rooms", c.rooms},
                               {"views", c.views},
                               {"usable", c.usable},
                               {"pixels", c.pixels},
                               {"valid", c.valid},
                               {"with_camera", c.with_camera},
                               {"with_emission", c.with_emission}};
    for (int q = 0; q < kMapQuantities; ++q) {
      const Histogram& histogram = c.histograms[static_cast<std::size_t>(q)];
      if (histogram.count() == 0) continue;
      one["quantities"][info(static_cast<MapQuantity>(q)).name] = {{"unit", info(static_cast<MapQuantity>(q)).unit},
                                                                   {"count", histogram.count()},
                                                                   {"q10", histogram.quantile(0.1)},
                                                                   {"q50", histogram.quantile(0.5)},
                                                                   {"q90", histogram.quantile(0.9)}};
    }
    one["problems"] = nlohmann::ordered_json::array();
    for (const DataProblem& p : c.problems) one["problems"].push_back({{"file", p.file}, {"what", p.what}});
    all.push_back(std::move(one));
  }
  return json_text(nlohmann::ordered_json{{"folders", std::move(all)}});
}

void write_report(const std::vector<DataCheck>& checks, const DataArguments& arguments, const CommonOptions& common) {
  HtmlReport page("Data sets", "What the maps of rooms show");
  page.section("Folders").table(folders_table(checks)).table(quantities_table(checks));
  page.section("Distributions");
  for (const Plot& plot : plots(checks)) page.plot(plot);
  if (const std::string text = problems_text(checks); !text.empty()) page.section("Problems").details("Files", text);
  page.footer(begin_provenance(common.command)).write(arguments.report);
}

std::vector<DataCheck> check_folders(const std::vector<std::string>& folders, int views) {
  std::vector<DataCheck> checks;
  for (const std::string& folder : folders) {
    std::unique_ptr<Progress> bar;
    checks.push_back(check_data(folder, views, [&](int done, int total) {
      if (!bar) bar = std::make_unique<Progress>(folder, total, "views");
      bar->update(done);
      give_up_if_interrupted(folder);
    }));
  }
  return checks;
}

/// The folders of a data set with a name; what makes it another one becomes their problem.
std::vector<DataCheck> check_set(const DataArguments& arguments) {
  if (arguments.folders.size() != 1)
    throw usage_error("is of one data set", "--manifest", fmt::format("{} folders", arguments.folders.size()),
                      "one DIR");
  const Manifest manifest = read_manifest(arguments.manifest);
  const std::filesystem::path dir = arguments.folders[0];
  std::vector<std::string> folders;
  for (const SetSplit& split : manifest.splits) folders.push_back((dir / split.name).string());
  std::vector<DataCheck> checks = check_folders(folders, arguments.views);
  for (std::size_t i = 0; i < checks.size(); ++i)
    check_split(manifest, manifest.splits[i], dir, manifest.splits[i].rooms,
                [&](const std::filesystem::path& file, const std::string& what) {
                  const auto same = [&](const auto& p) { return p.file == file.string() && p.what == what; };
                  auto& known = checks[i].problems;
                  if (std::ranges::none_of(known, same)) known.push_back({file.string(), what});
                });
  return checks;
}

void check(const DataArguments& arguments, const CommonOptions& common) {
  if (arguments.views < 0)
    throw usage_error("out of range", "--views", fmt::format("{}", arguments.views), "1 or more, or 0 for all");
  catch_interrupts();
  std::optional<AtomicFile> tried;
  if (!arguments.report.empty()) tried.emplace(arguments.report);  // not to find out after an hour
  const std::vector<DataCheck> checks =
      arguments.manifest.empty() ? check_folders(arguments.folders, arguments.views) : check_set(arguments);
  tried.reset();
  if (!common.json || !common.json->empty())
    std::fputs(terminal_text(table_text(folders_table(checks)) + "\n" + table_text(quantities_table(checks)) + "\n" +
                             problems_text(checks))
                   .c_str(),
               stdout);
  if (!arguments.report.empty()) write_report(checks, arguments, common);
  if (common.json) write_json_result(common, data_json(checks));
  std::size_t problems = 0;
  for (const DataCheck& c : checks) problems += c.problems.size();
  if (problems > 0)
    throw usage_error("there are problems with these files", fmt::format("{}", fmt::join(arguments.folders, ", ")),
                      fmt::format("{} problems", problems), "none");
}

}  // namespace

void add_data_commands(CommandLine& line) {
  auto arguments = std::make_shared<DataArguments>();
  line.describe_group("data", "Data sets in InteriorVerse's layout");
  line.add("data check", "How the maps of rooms are distributed, side by side, and which files are at fault")
      .arguments("DIR", "Folders of rooms with train.txt, val.txt or test.txt", arguments->folders, 1)
      .option("--views", "N", "look at so many views of each folder, spread over its lists; 0: at all",
              arguments->views)
      .option("--manifest", "FILE",
              "whether DIR is the data set that such a file names, whole and right: what `generate "
              "--manifest FILE --out DIR` makes",
              arguments->manifest)
      .option("--report", "FILE", "also a page with the distributions as curves (HTML)", arguments->report)
      .common({Common::Json, Common::Quiet})
      .notes("Ends with an exit code that is not 0 when there is a problem.")
      .run([arguments](const CommonOptions& common) { check(*arguments, common); });
}

}  // namespace clerestory
