// Values of a config as text: shared by reading, dumping and documenting.
#pragma once
#include <string>
#include <string_view>

#include "host/io/config.hpp"

namespace clerestory {

/// "an integer", "a list of texts": the type of a value, for messages.
std::string type_words(const ConfigValue& value);
/// The value as TOML writes it; numbers read back to the same bits.
std::string toml_value(const ConfigValue& value);
/// A TOML basic string with its quotes.
std::string toml_text(std::string_view text);
/// What a key allows: "1 to 64", "vndf_caps, ndf", or empty.
std::string allowed_words(const Schema::Key& key);
/// Throws ErrorKind::Usage when `value` breaks bounds or choices of `key`. `name` is the full name, `where` file:line.
void check_allowed(const Schema::Key& key, const ConfigValue& value, const std::string& name, const std::string& where);
/// Splits at commas outside of brackets and quotes. A quote begins where a value does: "dad's" holds none.
std::vector<std::string> split_values(const std::string& text);
/// Reads `text` (right side of an override) as the key's type; texts need no quotes.
ConfigValue parse_override_value(const Schema::Key& key, const std::string& name, const std::string& text,
                                 const std::string& where);
/// The member of `words` at the smallest edit distance; empty for no words.
std::string nearest_word(std::string_view word, const std::vector<std::string>& words);

}  // namespace clerestory
