// What is known of a JSON or TOML text before a library reads it: how deep its brackets go, which the library goes down
// by calling itself.
#pragma once
#include <string>
#include <string_view>

namespace clerestory {

/// Levels of arrays, tables and dotted names that a JSON or TOML text may have.
constexpr int max_nesting = 100;

/// Throws usage_error naming `where` and the line at which JSON or TOML goes deeper than max_nesting, by brackets or by
/// the dots of a name. Texts and comments do not count; whether the text is valid otherwise is not looked at.
void check_nesting(std::string_view text, const std::string& where);

}  // namespace clerestory
