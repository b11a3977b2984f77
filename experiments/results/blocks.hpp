// Tables of results in README, docs and the model card. Between two lines
//   <!-- result NAME TABLE -->
//   <!-- end of result -->
// stands that table of docs/results/NAME.json as Markdown, and nothing else: it is put there, never written by hand.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace clerestory {

struct Block {
  std::string result, table;
  int line = 0;      // of its first marker, from 1
  std::string text;  // between the markers, with its newlines
};

/// All blocks of a Markdown text, in order. Throws ErrorKind::Usage naming `where` and the line for a marker that is
/// malformed, not closed, or closes nothing: a misspelt one must not go unseen.
std::vector<Block> blocks_of(const std::string& markdown, const std::string& where);

/// The text with other contents between its markers; `fill` gives them. Throws what blocks_of() throws.
std::string with_blocks(const std::string& markdown, const std::string& where,
                        const std::function<std::string(const Block&)>& fill);

/// Files of a source tree that may hold blocks and are there: README.md, the model card, Markdown in docs/
/// (docs/results is made whole). Relative to the tree, sorted.
std::vector<std::filesystem::path> documents_of(const std::filesystem::path& tree);

}  // namespace clerestory
