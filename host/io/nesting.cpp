#include "host/io/nesting.hpp"

#include <algorithm>
#include <vector>

#include "host/error.hpp"

namespace clerestory {
namespace {

/// Where the text in quotes that begins at `at` ends: behind its last quote. Three quotes of a kind begin a text that
/// three end, the last of a longer row (TOML); a backslash takes the next character with it, but not in single quotes.
std::size_t end_of_quoted(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const std::string three(3, quote);
  const std::string_view mark = text.substr(at, 3) == three ? std::string_view(three) : text.substr(at, 1);
  for (std::size_t i = at + mark.size(); i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"')
      ++i;
    else if (text.substr(i, mark.size()) == mark && (mark.size() == 1 || text.substr(i + 1, 3) != three))
      return i + mark.size();
  }
  return text.size();
}

/// Calls see(i) for the characters outside of quotes and comments.
template <class See>
void walk(std::string_view text, const See& see) {
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '"' || text[i] == '\'')
      i = end_of_quoted(text, i) - 1;
    else if (text[i] == '#')
      i = std::min(text.find('\n', i), text.size()) - 1;
    else
      see(i);
}

std::string line_of(const std::string& where, std::string_view text, std::size_t at) {
  return fmt::format("{}:{}", where, 1 + std::count(text.begin(), text.begin() + at, '\n'));
}

}  // namespace

void check_nesting(std::string_view text, const std::string& where) {
  std::vector<int> open;    // levels that each open bracket took: itself, and the dots of the name before it
  int depth = 0, dots = 0;  // the sum of them; dots of the name or number being read
  const auto see = [&](std::size_t i) {
    const char c = text[i];
    if (c == '[' || c == '{') {
      open.push_back(dots + 1);
      depth += dots + 1, dots = 0;
    } else if (c == ']' || c == '}') {
      if (!open.empty()) depth -= open.back(), open.pop_back();
      dots = 0;
    } else if (c == ',' || c == '\n') {
      dots = 0;
    } else if (c == '.') {
      ++dots;
    }
    if (depth + dots > max_nesting)
      throw usage_error("is nested too deep", line_of(where, text, i), fmt::format("more than {} levels", max_nesting));
  };
  walk(text, see);
}

}  // namespace clerestory
