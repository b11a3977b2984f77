// What is known of a JSON or TOML text before a library reads it: how deep its brackets go, which the library goes down
// by calling itself, and whether it has letters that the library cannot take.
#pragma once
#include <string>
#include <string_view>

namespace clerestory {

/// Levels of arrays, tables and dotted names that a JSON or TOML text may have.
constexpr int max_nesting = 100;

/// Throws usage_error naming `where` and the line at which JSON or TOML goes deeper than max_nesting, by brackets or by
/// the dots of a name. Texts and comments do not count; whether the text is valid otherwise is not looked at.
void check_nesting(std::string_view text, const std::string& where);

/// Throws usage_error naming `where` and the line of a letter beyond ASCII outside of quotes and comments, or behind a
/// backslash in double quotes. TOML allows none there, and toml++ 3.3 runs into undefined behaviour at some
/// (is_non_ascii_horizontal_whitespace, U+00A1 to U+0499).
void check_ascii(std::string_view text, const std::string& where);

}  // namespace clerestory
