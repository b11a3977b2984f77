#include "experiments/commands/results.hpp"

#include <algorithm>
#include <cstdio>

#include "experiments/applications/light_choice.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/results/catalogue.hpp"
#include "experiments/results/result.hpp"
#include "experiments/weights/shipped.hpp"
#include "experiments/weights/weights.hpp"
#include "host/cl/device.hpp"
#include "host/io/files.hpp"
#include "host/report/table.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

struct ResultsArguments {
  fs::path run, tree = ".";
  std::string name, title;
  PlottedColumn plotted;
  bool stale = false, names = false;
};

/// Results belong to a source tree: the docs that quote them, the scripts that make them.
void must_be_tree(const fs::path& tree) {
  if (!fs::is_directory(tree / "experiments/reproduce"))
    throw usage_error("this is no source tree of the program", "--tree", fs::absolute(tree).lexically_normal().string(),
                      "a folder with experiments/reproduce");
}

void write(const ResultsArguments& a) {
  const auto fit = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  if (a.name.empty() || !std::ranges::all_of(a.name, fit))
    throw usage_error("not fit for the name of a file", "--name", "'" + a.name + "'", "letters, digits, _ and -");
  const Result result = result_of_run(a.run, a.name, a.title.empty() ? a.name : a.title, a.plotted, a.tree);
  write_result(result, a.tree);
  const fs::path json = result_file(a.tree, a.name);
  for (const char* ending : {".json", ".md", ".svg"})
    std::printf("%s\n", fs::path(json).replace_extension(ending).c_str());
  for (const fs::path& document : refresh_blocks(a.tree, a.name)) std::printf("%s\n", (a.tree / document).c_str());
}

std::string state_of(const CatalogueEntry& entry) {
  if (entry.missing) return "missing";
  if (entry.current()) return "current";
  return fmt::format("stale: {}", fmt::join(entry.staled, ", "));
}

void list(const ResultsArguments& a) {
  Table table;
  table.columns = {{"result"}, {"minutes"}, {"state"}, {"what"}};
  for (const CatalogueEntry& entry : catalogue(a.tree)) {
    if (a.stale && entry.current()) continue;
    if (a.names) std::printf("%s\n", entry.name.c_str());
    table.add({entry.name, Measure{entry.minutes}, state_of(entry), entry.title});
  }
  if (!a.names) std::fputs(table_text(table).c_str(), stdout);
}

void check(const ResultsArguments& a) {
  const std::vector<CatalogueEntry> entries = catalogue(a.tree);
  std::size_t old = 0;
  for (const CatalogueEntry& entry : entries) {
    if (entry.current()) continue;
    ++old;
    std::printf("%s: %s\n", entry.name.c_str(), state_of(entry).c_str());
  }
  const std::vector<std::string> differences = differences_in(a.tree);
  for (const std::string& difference : differences) std::printf("%s\n", difference.c_str());
  std::printf("%zu results, %zu of them missing or stale; %zu differences from their figures\n", entries.size(), old,
              differences.size());
  if (!differences.empty())
    throw Error(ErrorKind::Failed, fmt::format("{} texts differ from their results", differences.size()),
                a.tree.string());
  if (a.stale && old > 0) throw Error(ErrorKind::Failed, fmt::format("{} results are missing or stale", old));
}

void refresh(const ResultsArguments& a) {
  for (const std::string& name : result_names(a.tree)) write_result(read_result(result_file(a.tree, name)), a.tree);
  for (const fs::path& document : refresh_blocks(a.tree)) std::printf("%s\n", (a.tree / document).c_str());
}

/// Another program, other kernels or other weights make other runs: none is gone on with or skipped by mistake.
std::string runs_folder() {
  std::string made = file_hash("/proc/self/exe") + kernels_hash() + file_hash(weights_or_shipped({}));
  if (const auto light = shipped_light())
    for (const fs::path& file : weights_files(*light)) made += file_hash(file);
  return fmt::format("runs/results/{:016x}", content_hash(made));
}

}  // namespace

void add_results_commands(CommandLine& line) {
  auto a = std::make_shared<ResultsArguments>();
  const auto in_tree = [a](void (*action)(const ResultsArguments&)) {
    return [a, action](const CommonOptions&) { must_be_tree(a->tree), action(*a); };
  };
  line.describe_group("results", "Figures of docs/results, and the tables of README and docs that are made from them");
  line.add("results write",
           "Makes docs/results/NAME.json, .md and .svg of a finished run, and NAME's tables in the docs")
      .argument("RUN", "Run directory of `clerestory run`, or a folder of its sweep", a->run)
      .option("--name", "NAME", "The result: that of experiments/reproduce/NAME.sh", a->name)
      .option("--title", "TEXT", "What it shows", a->title)
      .option("--table", "NAME", "Table of the plot; default: the first whose best is marked", a->plotted.table)
      .option("--plot", "COLUMN", "Its column; default: the first whose best is marked", a->plotted.column)
      .option("--tree", "DIR", "Source tree; default: the working folder", a->tree)
      .common({Common::Quiet})
      .run(in_tree(write));
  line.add("results check", "Compares every table with its figures; says which results are missing or stale")
      .flag("--stale", "These count as failures too", a->stale)
      .option("--tree", "DIR", "Source tree; default: the working folder", a->tree)
      .common({Common::Quiet})
      .notes(
          "Stale: the figures were made with other weights, another config or other kernels than are here now. Exit "
          "code "
          "1 where a table, a .md or a .svg is not that of its JSON.")
      .run(in_tree(check));
  line.add("results list", "What there is to measure, minutes on two cores, and whether it is current")
      .flag("--stale", "Only what is missing or stale", a->stale)
      .flag("--names", "Names alone, one a line", a->names)
      .option("--tree", "DIR", "Source tree; default: the working folder", a->tree)
      .common({Common::Quiet})
      .run(in_tree(list));
  line.add("results refresh", "Makes .md, .svg and the tables of the docs anew from the figures")
      .option("--tree", "DIR", "Source tree; default: the working folder", a->tree)
      .common({Common::Quiet})
      .run(in_tree(refresh));
  line.add("results folder", "Where this program with these weights keeps the runs of results: for run.root")
      .common({Common::Quiet})
      .run([](const CommonOptions&) { std::printf("%s\n", runs_folder().c_str()); });
}

}  // namespace clerestory
