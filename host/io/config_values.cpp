// Values of a config: to TOML text, from the text of an override, against bounds and choices.
#include "host/io/config_values.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace clerestory {
namespace {

std::string toml_number(double value) {
  // The shortest decimal that reads back to the same double. TOML wants a point or an exponent in a real.
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos && std::isfinite(value)) text += ".0";
  return text;
}

template <class T>
std::string toml_list(const std::vector<T>& list) {
  std::string text = "[";
  for (std::size_t i = 0; i < list.size(); ++i) text += (i ? ", " : "") + toml_value(ConfigValue(T(list[i])));
  return text + "]";
}

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(" \t") - first + 1));
}

std::string unquoted(const std::string& text, const std::string& where) {
  if (text.empty() || (text.front() != '"' && text.front() != '\'')) return text;
  if (text.size() < 2 || text.back() != text.front())
    throw usage_error("quotation mark without its partner", where, text);
  return text.substr(1, text.size() - 2);
}

/// "[a, b]" or "a" to its items.
std::vector<std::string> list_items(const std::string& text, const std::string& where) {
  std::string inside = trimmed(text);
  if (!inside.empty() && inside.front() == '[') {
    if (inside.back() != ']') throw usage_error("a list ends with ]", where, text);
    inside = trimmed(inside.substr(1, inside.size() - 2));
    if (inside.empty()) return {};
  }
  std::vector<std::string> items = split_values(inside);
  for (std::string& item : items) item = trimmed(item);
  return items;
}

/// A whole text as a number. from_chars knows neither a leading + nor TOML's underscores; neither is needed here.
template <class T>
T parse_number(const std::string& text, const std::string& name, const std::string& where, const char* expected) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty())
    throw usage_error("wrong type for " + name, where, text, expected);
  return value;
}

bool parse_flag(const std::string& text, const std::string& name, const std::string& where) {
  if (text == "true") return true;
  if (text == "false") return false;
  throw usage_error("wrong type for " + name, where, text, "true or false");
}

template <class T>
std::vector<T> parse_numbers(const std::string& text, const std::string& name, const std::string& where,
                             const char* expected) {
  std::vector<T> list;
  for (const std::string& item : list_items(text, where)) list.push_back(parse_number<T>(item, name, where, expected));
  return list;
}

void check_number(const Schema::Key& key, double value, const std::string& name, const std::string& where) {
  if (!std::isfinite(value)) throw usage_error(name + " is not a finite number", where, fmt::format("{}", value));
  if (value < key.bounds.least || value > key.bounds.most)
    throw usage_error(name + " is out of range", where, fmt::format("{}", value), allowed_words(key));
}

void check_choice(const Schema::Key& key, const std::string& value, const std::string& name, const std::string& where) {
  if (key.choices.empty() || std::ranges::find(key.choices, value) != key.choices.end()) return;
  throw usage_error(
      fmt::format("{} has no choice {}, did you mean {}?", name, toml_text(value), nearest_word(value, key.choices)),
      where, {}, "one of " + allowed_words(key));
}

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // Clang 14 makes none itself

}  // namespace

std::vector<std::string> split_values(const std::string& text) {
  std::vector<std::string> values(1);
  int depth = 0;
  char quote = 0, before = ',';  // the last character that is no blank
  for (const char c : text) {
    const bool begins = before == ',' || before == '[';
    if (c == quote)
      quote = 0;
    else if (!quote && begins && (c == '"' || c == '\''))
      quote = c;
    else if (!quote)
      depth += (c == '[') - (c == ']');
    if (c != ' ' && c != '\t') before = c;
    if (c == ',' && depth == 0 && !quote)
      values.emplace_back();
    else
      values.back() += c;
  }
  return values;
}

std::string type_words(const ConfigValue& value) {
  static const char* const words[] = {"true or false",    "integer",         "number",       "text",
                                      "list of integers", "list of numbers", "list of texts"};
  return words[value.index()];
}

std::string toml_text(std::string_view text) {
  std::string quoted = "\"";
  for (char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      quoted += std::string("\\") + c;
    else if (byte < 0x20 || byte == 0x7f)
      quoted += fmt::format("\\u{:04X}", byte);
    else
      quoted += c;
  }
  return quoted + "\"";
}

std::string toml_value(const ConfigValue& value) {
  return std::visit(Overloaded{
                        [](bool v) { return std::string(v ? "true" : "false"); },
                        [](std::int64_t v) { return fmt::format("{}", v); },
                        [](double v) { return toml_number(v); },
                        [](const std::string& v) { return toml_text(v); },
                        [](const auto& list) { return toml_list(list); },
                    },
                    value);
}

std::string allowed_words(const Schema::Key& key) {
  if (!key.choices.empty()) return fmt::format("{}", fmt::join(key.choices, ", "));
  const bool below = std::isfinite(key.bounds.least), above = std::isfinite(key.bounds.most);
  if (below && above) return fmt::format("{} to {}", key.bounds.least, key.bounds.most);
  if (below) return fmt::format("at least {}", key.bounds.least);
  if (above) return fmt::format("at most {}", key.bounds.most);
  return {};
}

void check_allowed(const Schema::Key& key, const ConfigValue& value, const std::string& name,
                   const std::string& where) {
  std::visit(Overloaded{
                 [](bool) {},
                 [&](std::int64_t v) { check_number(key, static_cast<double>(v), name, where); },
                 [&](double v) { check_number(key, v, name, where); },
                 [&](const std::string& v) { check_choice(key, v, name, where); },
                 [&](const std::vector<std::int64_t>& list) {
                   for (std::int64_t v : list) check_number(key, static_cast<double>(v), name, where);
                 },
                 [&](const std::vector<double>& list) {
                   for (double v : list) check_number(key, v, name, where);
                 },
                 [&](const std::vector<std::string>& list) {
                   for (const std::string& v : list) check_choice(key, v, name, where);
                 },
             },
             value);
}

ConfigValue parse_override_value(const Schema::Key& key, const std::string& name, const std::string& text,
                                 const std::string& where) {
  const std::string value = trimmed(text);
  return std::visit(
      Overloaded{
          [&](bool) -> ConfigValue { return parse_flag(value, name, where); },
          [&](std::int64_t) -> ConfigValue { return parse_number<std::int64_t>(value, name, where, "an integer"); },
          [&](double) -> ConfigValue { return parse_number<double>(value, name, where, "a number"); },
          [&](const std::string&) -> ConfigValue { return unquoted(value, where); },
          [&](const std::vector<std::int64_t>&) -> ConfigValue {
            return parse_numbers<std::int64_t>(value, name, where, "a list of integers");
          },
          [&](const std::vector<double>&) -> ConfigValue {
            return parse_numbers<double>(value, name, where, "a list of numbers");
          },
          [&](const std::vector<std::string>&) -> ConfigValue {
            std::vector<std::string> list;
            for (const std::string& item : list_items(value, where)) list.push_back(unquoted(item, where));
            return list;
          },
      },
      key.value);
}

}  // namespace clerestory
