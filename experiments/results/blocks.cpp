#include "experiments/results/blocks.hpp"

#include <algorithm>
#include <optional>
#include <sstream>

#include "host/error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBegin = "<!-- result ", kEnd = "<!-- end of result -->";

std::string trimmed(const std::string& line) {
  const auto from = line.find_first_not_of(" \t\r"), to = line.find_last_not_of(" \t\r");
  return from == std::string::npos ? "" : line.substr(from, to - from + 1);
}

/// Whether the line is meant as a marker, whatever its spelling.
bool speaks_of_results(const std::string& line) {
  return line.starts_with("<!--") && line.find("result") != std::string::npos;
}

/// "<!-- result NAME TABLE -->" and nothing else.
std::optional<Block> begun_by(const std::string& line, int number) {
  if (!line.starts_with(kBegin)) return {};
  std::istringstream words(line.substr(kBegin.size()));
  Block block;
  std::string close, more;
  words >> block.result >> block.table >> close >> more;
  block.line = number;
  return close == "-->" && more.empty() ? std::optional(block) : std::nullopt;
}

/// Calls `outside` with each line that stays, the markers too, and `inside` with each whole block at its end.
template <class Outside, class Inside>
void walk(const std::string& markdown, const std::string& where, const Outside& outside, const Inside& inside) {
  std::istringstream lines(markdown);
  std::optional<Block> open;
  int number = 0;
  const auto fail = [&](const char* what, int line, const std::string& found) {
    throw usage_error(what, fmt::format("{}:{}", where, line), found,
                      fmt::format("{}NAME TABLE --> ... {}", kBegin, kEnd));
  };
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::string words = trimmed(line);
    if (words == kEnd) {
      if (!open) fail("nothing to close", number, words);
      inside(*open);
      open.reset();
    } else if (speaks_of_results(words)) {
      if (open) fail("the block before is not closed", open->line, words);
      open = begun_by(words, number);
      if (!open) fail("not a marker of a result", number, words);
    } else if (open) {
      open->text += line + "\n";
      continue;
    }
    outside(line + (lines.eof() ? "" : "\n"));
  }
  if (open) fail("a block is not closed", open->line, open->result);
}

}  // namespace

std::vector<Block> blocks_of(const std::string& markdown, const std::string& where) {
  std::vector<Block> blocks;
  walk(
      markdown, where, [](const std::string&) {}, [&](const Block& block) { blocks.push_back(block); });
  return blocks;
}

std::string with_blocks(const std::string& markdown, const std::string& where,
                        const std::function<std::string(const Block&)>& fill) {
  std::string out;
  walk(
      markdown, where, [&](const std::string& line) { out += line; }, [&](const Block& block) { out += fill(block); });
  return out;
}

std::vector<fs::path> documents_of(const fs::path& tree) {
  std::vector<fs::path> documents;
  for (const char* name : {"README.md", "nets/weights/CARD.md"})
    if (fs::is_regular_file(tree / name)) documents.emplace_back(name);
  if (fs::is_directory(tree / "docs"))
    for (const auto& entry : fs::recursive_directory_iterator(tree / "docs")) {
      const fs::path path = entry.path().lexically_relative(tree);
      if (path.extension() == ".md" && path.parent_path() != "docs/results") documents.push_back(path);
    }
  std::ranges::sort(documents);
  return documents;
}

}  // namespace clerestory
