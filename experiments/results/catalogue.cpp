#include "experiments/results/catalogue.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include "experiments/results/blocks.hpp"
#include "experiments/results/result.hpp"
#include "experiments/studies/study.hpp"
#include "host/cl/device.hpp"
#include "host/error.hpp"
#include "host/io/files.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMinutes = "# minutes: ";

fs::path scripts_folder(const fs::path& tree) { return tree / "experiments/reproduce"; }

/// Title and minutes from a script's first comment; nothing for a script that makes no result.
std::optional<CatalogueEntry> entry_of(const fs::path& script) {
  std::istringstream lines(read_file(script));
  CatalogueEntry entry;
  entry.name = script.stem().string();
  for (std::string line; std::getline(lines, line) && line.starts_with("#");) {
    if (line.starts_with("#!")) continue;
    if (!line.starts_with(kMinutes)) {
      const auto words = line.find_first_not_of("# ");
      if (words != std::string::npos) entry.title += (entry.title.empty() ? "" : " ") + line.substr(words);
      continue;
    }
    std::istringstream number(line.substr(kMinutes.size()));
    if (!(number >> entry.minutes) || entry.minutes <= 0 || entry.title.empty())
      throw usage_error("a script of a result needs a title and minutes", script.string(), line,
                        "comments of a title, then " + std::string(kMinutes) + "N");
    if (entry.title.ends_with('.')) entry.title.pop_back();
    return entry;
  }
  return {};
}

/// Of the code in this program, by the names that results have for it.
std::map<std::string, std::string> kernels_now() {
  std::map<std::string, std::string> kernels;
  for (const std::string& file : kernel_files())
    if (file.ends_with(".cl")) kernels["kernels/" + file] = kernel_hash(file);
  return kernels;
}

std::vector<std::string> staled(const Result& result, const std::map<std::string, std::string>& kernels,
                                const fs::path& tree) {
  std::vector<std::string> reasons;
  for (const auto& [kernel, hash] : result.kernels)
    if (const auto now = kernels.find(kernel); now == kernels.end() || now->second != hash) reasons.push_back(kernel);
  try {
    const ResultCommand& c = result.command;
    if (study_hash(tree / c.config, c.overrides, c.many) != result.config_hash) reasons.push_back(c.config);
  } catch (const Error& error) {
    reasons.push_back(result.command.config + " (" + error.what() + ")");
  }
  for (const FileRecord& input : result.inputs)
    if (!fs::exists(tree / input.path))
      reasons.push_back(input.path + " (gone)");
    else if (file_hash(tree / input.path) != input.hash)
      reasons.push_back(input.path);
  return reasons;
}

std::string text_or_nothing(const fs::path& path) { return fs::exists(path) ? read_file(path) : ""; }

std::map<std::string, Result> results_in(const fs::path& tree) {
  std::map<std::string, Result> results;
  for (const std::string& name : result_names(tree)) results[name] = read_result(result_file(tree, name));
  return results;
}

/// The Markdown of a block. Throws ErrorKind::Usage when there is no such table.
std::string block_text(const Block& block, const std::map<std::string, Result>& results, const std::string& where) {
  const std::string place = fmt::format("{}:{}", where, block.line);
  const auto result = results.find(block.result);
  if (result == results.end()) throw usage_error("no such result", place, block.result, "a file of docs/results");
  const auto table = result->second.tables.find(block.table);
  if (table != result->second.tables.end()) return table_markdown(table->second);
  std::vector<std::string> names;
  for (const auto& [name, unused] : result->second.tables) names.push_back(name);
  throw usage_error("result " + block.result + " has no such table", place, block.table,
                    fmt::format("{}", fmt::join(names, ", ")));
}

/// "line 7: A, not B" for the first line in which two texts differ.
std::string first_difference(const std::string& text, const std::string& expected) {
  std::istringstream have(text), want(expected);
  std::string a, b;
  for (int line = 1;; ++line) {
    const bool more = static_cast<bool>(std::getline(have, a)), wanted = static_cast<bool>(std::getline(want, b));
    if (more && wanted && a == b) continue;
    return fmt::format("line {}: {}, expected: {}", line, more ? "'" + a + "'" : "ends",
                       wanted ? "'" + b + "'" : "ends");
  }
}

void compare_files(const Result& result, const fs::path& tree, std::vector<std::string>& found) {
  const fs::path json = result_file(tree, result.name);
  const fs::path markdown = fs::path(json).replace_extension(".md"), plot = fs::path(json).replace_extension(".svg");
  const auto name = [&](const fs::path& path) { return path.lexically_relative(tree).string(); };
  if (const std::string have = text_or_nothing(markdown), want = result_markdown(result); have != want)
    found.push_back(name(markdown) + ": differs from its JSON: " + first_difference(have, want));
  if (!text_or_nothing(plot).ends_with(plot_mark(result)))
    found.push_back(name(plot) + ": was not drawn from the figures of its JSON");
  if (!fs::exists(scripts_folder(tree) / (result.name + ".sh")))
    found.push_back(name(json) + ": no experiments/reproduce/" + result.name + ".sh makes it");
}

void compare_document(const fs::path& tree, const fs::path& document, const std::map<std::string, Result>& results,
                      std::vector<std::string>& found) {
  try {
    for (const Block& block : blocks_of(read_file(tree / document), document.string())) {
      const std::string want = block_text(block, results, document.string());
      if (block.text != want)
        found.push_back(fmt::format("{}:{}: differs from table {} of docs/results/{}.json: {}", document.string(),
                                    block.line, block.table, block.result, first_difference(block.text, want)));
    }
  } catch (const Error& error) {
    found.push_back(error.what());
  }
}

}  // namespace

std::vector<CatalogueEntry> catalogue(const fs::path& tree) {
  std::vector<CatalogueEntry> entries;
  const std::map<std::string, std::string> kernels = kernels_now();
  for (const auto& file : fs::directory_iterator(scripts_folder(tree))) {
    if (file.path().extension() != ".sh") continue;
    std::optional<CatalogueEntry> entry = entry_of(file.path());
    if (!entry) continue;
    const fs::path json = result_file(tree, entry->name);
    entry->missing = !fs::exists(json);
    if (!entry->missing) entry->staled = staled(read_result(json), kernels, tree);
    entries.push_back(std::move(*entry));
  }
  const auto order = [](const CatalogueEntry& e) { return std::tuple(e.current(), e.name); };
  std::ranges::sort(entries, {}, order);
  return entries;
}

std::vector<std::string> differences_in(const fs::path& tree) {
  std::vector<std::string> found;
  const std::map<std::string, Result> results = results_in(tree);
  for (const auto& [name, result] : results) {
    if (result.name != name) found.push_back("docs/results/" + name + ".json: calls itself " + result.name);
    compare_files(result, tree, found);
  }
  if (fs::is_directory(results_folder(tree)))
    for (const auto& entry : fs::directory_iterator(results_folder(tree)))
      if (!results.contains(entry.path().stem().string()))
        found.push_back(entry.path().lexically_relative(tree).string() + ": belongs to no JSON");
  for (const fs::path& document : documents_of(tree)) compare_document(tree, document, results, found);
  return found;
}

std::vector<fs::path> refresh_blocks(const fs::path& tree, const std::string& name) {
  const std::map<std::string, Result> results = results_in(tree);
  std::map<fs::path, std::string> changed;  // all are made before the first is written
  for (const fs::path& document : documents_of(tree)) {
    const std::string text = read_file(tree / document);
    const std::string refreshed = with_blocks(text, document.string(), [&](const Block& block) {
      return name.empty() || block.result == name ? block_text(block, results, document.string()) : block.text;
    });
    if (refreshed != text) changed[document] = refreshed;
  }
  std::vector<fs::path> files;
  for (const auto& [document, text] : changed) write_file(tree / document, text), files.push_back(document);
  return files;
}

}  // namespace clerestory
