// A literal such as 0.5 is double: it would turn single-precision kernels into double ones, and does not compile where
// a device has no double precision. Kernels write R(0.5).
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>

#include "host/cl/device.hpp"
#include "tests/cl/environment.hpp"

namespace clerestory {
namespace {

/// The text with comments blanked out, lines kept.
std::string without_comments(std::string text) {
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] != '/' || (text[i + 1] != '/' && text[i + 1] != '*')) continue;
    const bool line = text[i + 1] == '/';
    const std::size_t end = line ? text.find('\n', i) : text.find("*/", i + 2) + 2;
    for (; i < std::min(end, text.size()); ++i)
      if (text[i] != '\n') text[i] = ' ';
  }
  return text;
}

/// Whether position `at` is inside the brackets of R(...), on its line.
bool inside_real(const std::string& text, std::size_t at) {
  int depth = 0;
  for (std::size_t i = at; i-- > 1 && text[i] != '\n';) {
    if (text[i] == ')') ++depth;
    if (text[i] != '(' || depth-- > 0) continue;
    const bool whole_name = i < 2 || (!std::isalnum(static_cast<unsigned char>(text[i - 2])) && text[i - 2] != '_');
    if (text[i - 1] == 'R' && whole_name) return true;
    depth = 0;
  }
  return false;
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }
bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)); }

/// The name or number that starts at `at`, a sign in its exponent included.
std::string word_at(const std::string& text, std::size_t at) {
  std::size_t end = at;
  const bool number = is_digit(text[at]) || text[at] == '.';
  while (end < text.size() && (is_word(text[end]) || (number && (text[end] == '+' || text[end] == '-') &&
                                                      std::tolower(static_cast<unsigned char>(text[end - 1])) == 'e')))
    ++end;
  return text.substr(at, end - at);
}

bool is_double_literal(const std::string& word) {
  const bool number = is_digit(word[0]) || (word[0] == '.' && word.size() > 1 && is_digit(word[1]));
  if (!number || word.starts_with("0x") || word.starts_with("0X")) return false;
  const bool suffix = !is_digit(word.back()) && word.back() != '.';
  return !suffix && word.find_first_of(".eE") != std::string::npos;
}

std::vector<std::string> double_literals(const std::string& source) {
  const std::string text = without_comments(source);
  std::vector<std::string> found;
  for (std::size_t at = 0, line = 1; at < text.size();) {
    line += text[at] == '\n';
    const std::string word = word_at(text, at);
    if (!word.empty() && is_double_literal(word) && !inside_real(text, at))
      found.push_back(std::to_string(line) + ": " + word);
    at += std::max<std::size_t>(word.size(), 1);
  }
  return found;
}

TEST(Literals, TheSearchFindsThemAndNothingElse) {
  using Found = std::vector<std::string>;
  EXPECT_EQ(double_literals("real x = 0.5;\n// 0.5\n/* 1.0\n */ y = 1e-3 + .5 * z;"),
            (Found{"1: 0.5", "4: 1e-3", "4: .5"}));
  EXPECT_EQ(double_literals("f(1.0) + R(2.0); g(h(R(1), 3.));"), (Found{"1: 1.0", "1: 3."}));
  EXPECT_EQ(double_literals("R(0.5) R(-(1.5 * 2)) 1.0f 12 0x1e5 v.s01 a1.x FOUR(x) 1u"), Found{});
}

TEST(Literals, KernelsHaveNoneThatAreDouble) {
  ASSERT_FALSE(kernel_files().empty());
  for (const std::string& file : kernel_files())
    for (const std::string& literal :
         double_literals(read_text(std::string(CLERESTORY_SOURCE_DIR) + "/kernels/" + file)))
      ADD_FAILURE() << "kernels/" << file << ":" << literal << " is double; write R(...)";
}

}  // namespace
}  // namespace clerestory
