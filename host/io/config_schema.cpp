// The schema of a config: declaring keys, finding them, and the page that documents them.
#include <algorithm>
#include <utility>

#include "host/io/config.hpp"
#include "host/io/config_values.hpp"

namespace clerestory {
namespace {

/// Levenshtein's distance, a swap of neighbours counting as one edit (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        now[j] = std::min(now[j], before_last[j - 2] + 1);
    }
    before_last.swap(last);
    last.swap(now);
  }
  return last[b.size()];
}

std::string section_of(std::string_view name) {
  const auto dot = name.rfind('.');
  return dot == std::string_view::npos ? std::string() : std::string(name.substr(0, dot));
}

std::string leaf_of(std::string_view name) { return std::string(name.substr(name.rfind('.') + 1)); }

std::string escaped_for_table(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& words) {
  std::string best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::string& candidate : words) {
    // Forgetting the section is as common as a typing error: compare with and without it.
    const double whole = static_cast<double>(edit_distance(word, candidate));
    const double leaf = static_cast<double>(edit_distance(leaf_of(word), leaf_of(candidate))) + 0.5;
    const double distance =
        std::min(whole, section_of(word).empty() || section_of(candidate).empty() ? leaf : leaf + 1);
    if (distance < least) least = distance, best = candidate;
  }
  return best;
}

Schema& Schema::section(const std::string& name, const std::string& doc) {
  sections_[name] = doc;
  return *this;
}

Schema& Schema::add(Key key) {
  if (key.doc.empty()) throw Error(ErrorKind::Failed, "a key of a schema needs a line of documentation", key.name);
  const bool pattern = key.name.size() > 2 && key.name.ends_with(".*");
  if (pattern) key.has_default = false;
  if (key.has_default) check_allowed(key, key.value, key.name, "schema");
  last_ = key.name;
  if (!keys_.emplace(key.name, std::move(key)).second)
    throw Error(ErrorKind::Failed, "key declared twice in a schema", last_);
  return *this;
}

Schema& Schema::flag(const std::string& name, bool value, const std::string& doc) {
  return add({.name = name, .doc = doc, .value = value});
}
Schema& Schema::integer(const std::string& name, std::int64_t value, const std::string& doc, Bounds bounds) {
  return add({.name = name, .doc = doc, .value = value, .bounds = bounds});
}
Schema& Schema::real(const std::string& name, double value, const std::string& doc, Bounds bounds) {
  return add({.name = name, .doc = doc, .value = value, .bounds = bounds});
}
Schema& Schema::text(const std::string& name, const std::string& value, const std::string& doc,
                     std::vector<std::string> choices) {
  return add({.name = name, .doc = doc, .value = value, .choices = std::move(choices)});
}
Schema& Schema::integers(const std::string& name, std::vector<std::int64_t> value, const std::string& doc,
                         Bounds bounds) {
  return add({.name = name, .doc = doc, .value = std::move(value), .bounds = bounds});
}
Schema& Schema::reals(const std::string& name, std::vector<double> value, const std::string& doc, Bounds bounds) {
  return add({.name = name, .doc = doc, .value = std::move(value), .bounds = bounds});
}
Schema& Schema::texts(const std::string& name, std::vector<std::string> value, const std::string& doc,
                      std::vector<std::string> choices) {
  return add({.name = name, .doc = doc, .value = std::move(value), .choices = std::move(choices)});
}

Schema& Schema::optional() {
  keys_.at(last_).has_default = false;
  return *this;
}

Schema& Schema::aside() {
  keys_.at(last_).names_run = false;
  return *this;
}

Schema& Schema::later() {
  keys_.at(last_).default_names_run = false;
  return *this;
}

Schema& Schema::include(const Schema& other) {
  for (const auto& [name, key] : other.keys_) add(key);
  sections_.insert(other.sections_.begin(), other.sections_.end());
  return *this;
}

const Schema::Key* Schema::find(std::string_view name) const {
  if (const auto exact = keys_.find(std::string(name)); exact != keys_.end()) return &exact->second;
  const auto pattern = keys_.find(section_of(name) + ".*");
  return pattern == keys_.end() ? nullptr : &pattern->second;
}

std::string Schema::nearest(std::string_view name) const {
  std::vector<std::string> names;
  for (const auto& [known, key] : keys_) names.push_back(known);
  return nearest_word(name, names);
}

std::string config_page(const Schema& schema, const std::string& title) {
  std::map<std::string, std::string> tables;
  for (const auto& [name, key] : schema.keys()) {
    const std::string value = key.has_default ? "`" + toml_value(key.value) + "`" : "none";
    tables[section_of(name)] +=
        fmt::format("| `{}` | {} | {} | {} | {}{} |\n", name, type_words(key.value), escaped_for_table(value),
                    escaped_for_table(allowed_words(key)), escaped_for_table(key.doc),
                    key.names_run ? "" : " (not part of a run's name)");
  }
  std::string page = "# " + title + "\n";
  for (const auto& [section, rows] : tables) {
    page += fmt::format("\n## {}\n", section.empty() ? "Top level" : section);
    if (const auto doc = schema.sections().find(section); doc != schema.sections().end())
      page += "\n" + doc->second + "\n";
    page += "\n| Key | Type | Default | Allowed | Meaning |\n|---|---|---|---|---|\n" + rows;
  }
  return page;
}

}  // namespace clerestory
