// Loading a config: files and what they extend, overrides, typed reading, dumping.
#include "host/io/config.hpp"

// Not to be asserted of a file, as of a header "[=": where it does not hold, toml++ goes on to a parse error.
#define TOML_ASSERT(holds) static_assert(true)
#include <toml++/toml.h>

#include <algorithm>
#include <set>
#include <utility>

#include "host/io/config_values.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "host/io/nesting.hpp"

namespace clerestory {
namespace {

using Entries = std::map<std::string, ConfigEntry>;
constexpr std::uintmax_t kMostBytes = 1u << 20;  // a config is written by hand: a larger file is something else
constexpr int kMostFiles = 100;

std::string place(const std::string& file, const toml::node& node) {
  return fmt::format("{}:{}", file, node.source().begin.line);
}

std::string kind_words(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a section";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "text " + toml_text(node.as_string()->get());
    case toml::node_type::integer:
      return fmt::format("integer {}", node.as_integer()->get());
    case toml::node_type::floating_point:
      return fmt::format("number {}", node.as_floating_point()->get());
    case toml::node_type::boolean:
      return node.as_boolean()->get() ? "true" : "false";
    default:
      return "a date or time";
  }
}

/// The scalar types a key may take from TOML: exact, but an integer is a number too.
template <class T>
std::optional<T> scalar(const toml::node& node) {
  if constexpr (std::is_same_v<T, double>) {
    if (const auto* integer = node.as_integer()) return static_cast<double>(integer->get());
  }
  const auto* exact = node.as<T>();
  return exact ? std::optional<T>(exact->get()) : std::nullopt;
}

template <class T>
std::optional<std::vector<T>> list(const toml::node& node) {
  const toml::array* array = node.as_array();
  if (!array) return std::nullopt;
  std::vector<T> values;
  for (const toml::node& item : *array) {
    auto value = scalar<T>(item);
    if (!value) return std::nullopt;
    values.push_back(std::move(*value));
  }
  return values;
}

std::optional<ConfigValue> converted(const ConfigValue& like, const toml::node& node) {
  return std::visit(
      [&]<class T>(const T&) -> std::optional<ConfigValue> {
        if constexpr (requires { typename T::allocator_type; } && !std::is_same_v<T, std::string>)
          return list<typename T::value_type>(node);
        else
          return scalar<T>(node);
      },
      like);
}

ConfigValue value_for(const Schema::Key& key, const std::string& name, const toml::node& node,
                      const std::string& where) {
  auto value = converted(key.value, node);
  if (!value) throw usage_error("wrong type for " + name, where, kind_words(node), type_words(key.value));
  check_allowed(key, *value, name, where);
  return std::move(*value);
}

Error unknown_key(const Schema& schema, const std::string& name, const std::string& where) {
  return usage_error(fmt::format("unknown key {}, the nearest known one is {}", name, schema.nearest(name)), where);
}

bool is_section(const Schema& schema, const std::string& name) {
  const auto next = schema.keys().lower_bound(name + ".");
  return next != schema.keys().end() && next->first.starts_with(name + ".");
}

class Loader {
 public:
  Loader(const Schema& schema, Entries& entries, std::vector<ConfigVariant>& variants)
      : schema_(schema), entries_(entries), variants_(variants) {}

  void load_file(const std::filesystem::path& path) {
    const std::string name = path.string();
    const std::filesystem::path real = std::filesystem::weakly_canonical(path);
    if (std::ranges::find(open_, real) != open_.end()) throw usage_error("extends itself: " + chain(real), name);
    if (++files_ > kMostFiles)  // files that extend each other twice over are read again each time
      throw usage_error("extends too many files", name, fmt::format("{}", files_),
                        fmt::format("at most {}", kMostFiles));
    open_.push_back(real);
    const toml::table root = parse(read_file(path, kMostBytes, true), name);
    for (const std::string& base : bases(root, name)) load_file(path.parent_path() / base);
    take(root, name);
    open_.pop_back();
  }

  void load_text(std::string_view text, const std::string& name) {
    const toml::table root = parse(text, name);
    if (const toml::node* extends = root.get("extends"))
      throw usage_error("extends needs a file to be relative to", place(name, *extends));
    take(root, name);
  }

 private:
  static toml::table parse(std::string_view text, const std::string& name) {
    check_nesting(text, name), check_ascii(text, name);
    try {
      return toml::parse(text, std::string_view(name));
    } catch (const toml::parse_error& error) {
      throw usage_error("not valid TOML: " + std::string(error.description()),
                        fmt::format("{}:{}", name, error.source().begin.line));
    }
  }

  static std::vector<std::string> bases(const toml::table& root, const std::string& file) {
    const toml::node* node = root.get("extends");
    if (!node) return {};
    if (auto one = scalar<std::string>(*node)) return {*one};
    if (auto many = list<std::string>(*node)) return *many;
    throw usage_error("wrong type for extends", place(file, *node), kind_words(*node), "a file name or a list of them");
  }

  std::string chain(const std::filesystem::path& again) const {
    std::string text;
    for (const auto& path : open_) text += path.filename().string() + " -> ";
    return text + again.filename().string();
  }

  void take(const toml::table& root, const std::string& file) {
    for (const auto& [key, node] : root) {
      if (key == "extends") continue;
      if (key == "variant" && !schema_.find("variant"))
        take_variants(node, file);
      else
        take_node(std::string(key.str()), node, file);
    }
  }

  void take_node(const std::string& name, const toml::node& node, const std::string& file) {
    const std::string where = place(file, node);
    const toml::table* table = node.as_table();
    const Schema::Key* key = schema_.find(name);
    if (table && !key && (!table->empty() || is_section(schema_, name))) {
      for (const auto& [child_key, child] : *table) {
        const std::string leaf(child_key.str());
        if (leaf.empty() || leaf.find('.') != std::string::npos)
          throw usage_error("a key's name is neither empty nor holds a point", place(file, child), toml_text(leaf));
        take_node(name + "." + leaf, child, file);
      }
      return;
    }
    if (!key && is_section(schema_, name))
      throw usage_error(name + " is a section", where, kind_words(node), "keys below [" + name + "]");
    if (!key) throw unknown_key(schema_, name, where);
    entries_[name] = {value_for(*key, name, node, where), where};
  }

  void take_variants(const toml::node& node, const std::string& file) {
    const toml::array* array = node.as_array();
    if (!array || !array->is_array_of_tables())
      throw usage_error("variants are written as [[variant]]", place(file, node), kind_words(node));
    std::set<std::string> here;
    for (const toml::node& item : *array) {
      ConfigVariant variant = read_variant(*item.as_table(), file);
      if (!here.insert(variant.name).second)
        throw usage_error("variant " + variant.name + " occurs twice", variant.origin);
      const auto same = std::ranges::find(variants_, variant.name, &ConfigVariant::name);
      if (same == variants_.end())
        variants_.push_back(std::move(variant));
      else
        *same = std::move(variant);  // a file redefines a variant of what it extends
    }
  }

  static ConfigVariant read_variant(const toml::table& table, const std::string& file) {
    ConfigVariant variant;
    variant.origin = place(file, table);
    for (const auto& [key, node] : table) {
      const std::string where = place(file, node);
      const auto text = scalar<std::string>(node);
      const auto texts = list<std::string>(node);
      if (key == "name" && text)
        variant.name = *text;
      else if (key == "label" && text)
        variant.label = *text;
      else if (key == "overrides" && texts)
        variant.overrides = *texts;
      else
        throw usage_error(fmt::format("variant.{} is unknown or of the wrong type", key.str()), where, kind_words(node),
                          "name and label (text), overrides (list of texts)");
    }
    const bool plain = !variant.name.empty() && variant.name.find_first_not_of(
                                                    "abcdefghijklmnopqrstuvwxyz"
                                                    "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                                    "0123456789-_.+") == std::string::npos;
    if (!plain || variant.name.front() == '.')
      throw usage_error("a variant needs a name fit for a folder", variant.origin, toml_text(variant.name),
                        "letters, digits, - _ . +");
    if (variant.label.empty()) variant.label = variant.name;
    return variant;
  }

  const Schema& schema_;
  Entries& entries_;
  std::vector<ConfigVariant>& variants_;
  std::vector<std::filesystem::path> open_;
  int files_ = 0;
};

Entries default_entries(const Schema& schema) {
  Entries entries;
  for (const auto& [name, key] : schema.keys())
    if (key.has_default) entries[name] = {key.value, "default"};
  return entries;
}

std::string toml_key(const std::string& name) {
  const bool bare = !name.empty() &&
                    std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_'; });
  return bare ? name : toml_text(name);
}

/// "a.b.c" to ("a.b", "c"), both quoted where TOML wants it.
std::pair<std::string, std::string> toml_place(const std::string& name) {
  std::string section;
  std::size_t from = 0, dot;
  while ((dot = name.find('.', from)) != std::string::npos) {
    section += (section.empty() ? "" : ".") + toml_key(name.substr(from, dot - from));
    from = dot + 1;
  }
  return {section, toml_key(name.substr(from))};
}

std::string entries_toml(const Entries& entries) {
  std::map<std::string, std::map<std::string, std::string>> sections;
  for (const auto& [name, entry] : entries) {
    const auto [section, key] = toml_place(name);
    sections[section][key] = toml_value(entry.value);
  }
  std::string text;
  for (const auto& [section, keys] : sections) {
    if (!section.empty()) text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", section);
    for (const auto& [key, value] : keys) text += key + " = " + value + "\n";
  }
  return text;
}

}  // namespace

Config::Config(const Schema& schema, const std::vector<std::string>& overrides)
    : schema_(std::make_shared<const Schema>(schema)), from_files_(default_entries(schema)), overrides_(overrides) {
  rebuild();
}

Config load_config(const std::filesystem::path& path, const Schema& schema, const std::vector<std::string>& overrides) {
  Config config(schema);
  Loader(schema, config.from_files_, config.variants_).load_file(found_data(path));
  return config.with(overrides);
}

Config parse_config(std::string_view toml, const std::string& name, const Schema& schema,
                    const std::vector<std::string>& overrides) {
  Config config(schema);
  Loader(schema, config.from_files_, config.variants_).load_text(toml, name);
  return config.with(overrides);
}

void Config::rebuild() {
  entries_ = from_files_;
  if (chosen_)
    for (const std::string& text : chosen_->overrides)
      apply(text, fmt::format("{}: variant {}: {}", chosen_->origin, chosen_->name, text));
  for (const std::string& text : overrides_) apply(text, text);
}

void Config::apply(const std::string& override_text, const std::string& origin) {
  const bool either = override_text.starts_with("++"), add = !either && override_text.starts_with("+");
  const bool remove = override_text.starts_with("~");
  const std::string_view rest = std::string_view(override_text).substr(either ? 2 : add || remove ? 1 : 0);
  const auto equals = rest.find('=');
  const std::string name(rest.substr(0, equals));
  if (name.empty() || (equals == std::string_view::npos) != remove)
    throw usage_error("not an override", origin, {}, "key=value, +key=value, ++key=value or ~key");

  const Schema::Key* key = name.ends_with("*") ? nullptr : schema_->find(name);
  if (!key) throw unknown_key(*schema_, name, origin);
  const auto entry = entries_.find(name);
  if (entry == entries_.end() && !add && !either)
    throw usage_error(name + " has no value yet", origin, {}, remove ? "" : "+" + std::string(rest));
  if (entry != entries_.end() && add)
    throw usage_error(name + " has a value already (" + entry->second.origin + ")", origin, {}, std::string(rest));

  if (remove) {
    if (key->has_default)
      entry->second = {key->value, "default"};
    else
      entries_.erase(entry);
    return;
  }
  ConfigValue value = parse_override_value(*key, name, std::string(rest.substr(equals + 1)), origin);
  check_allowed(*key, value, name, origin);
  entries_[name] = {std::move(value), origin};
}

Config Config::variant(std::string_view name) const {
  const auto found = std::ranges::find(variants_, name, &ConfigVariant::name);
  if (found == variants_.end()) {
    std::vector<std::string> names;
    for (const ConfigVariant& v : variants_) names.push_back(v.name);
    throw usage_error(fmt::format("no variant {}", name), {}, {},
                      names.empty() ? "a config with [[variant]]" : "for instance " + nearest_word(name, names));
  }
  Config copy = *this;
  copy.chosen_ = *found;
  copy.rebuild();
  return copy;
}

Config Config::with(const std::vector<std::string>& overrides) const {
  Config copy = *this;
  copy.overrides_.insert(copy.overrides_.end(), overrides.begin(), overrides.end());
  copy.rebuild();
  return copy;
}

template <class T>
const T& Config::get(std::string_view key) const {
  const auto entry = entries_.find(std::string(key));
  if (entry == entries_.end())
    throw Error(ErrorKind::Failed, "the program reads a key that has no value", std::string(key));
  const T* value = std::get_if<T>(&entry->second.value);
  if (!value)
    throw Error(ErrorKind::Failed, "the program reads a key as another type", std::string(key), type_words(T{}),
                type_words(entry->second.value));
  return *value;
}

bool Config::has(std::string_view key) const { return entries_.contains(std::string(key)); }
bool Config::flag(std::string_view key) const { return get<bool>(key); }
std::int64_t Config::integer(std::string_view key) const { return get<std::int64_t>(key); }
double Config::real(std::string_view key) const { return get<double>(key); }
const std::string& Config::text(std::string_view key) const { return get<std::string>(key); }
const std::vector<std::int64_t>& Config::integers(std::string_view key) const {
  return get<std::vector<std::int64_t>>(key);
}
const std::vector<double>& Config::reals(std::string_view key) const { return get<std::vector<double>>(key); }
const std::vector<std::string>& Config::texts(std::string_view key) const { return get<std::vector<std::string>>(key); }

std::string Config::origin(std::string_view key) const {
  const auto entry = entries_.find(std::string(key));
  return entry == entries_.end() ? "default" : entry->second.origin;
}

std::string config_toml(const Config& config) { return entries_toml(config.entries()); }

std::string config_hash(const Config& config) {
  Entries naming;
  for (const auto& [name, entry] : config.entries())
    if (config.schema().find(name)->names_run) naming.insert({name, entry});
  const std::uint64_t hash = content_hash(entries_toml(naming));
  return fmt::format("{:08x}", static_cast<std::uint32_t>(hash ^ (hash >> 32)));
}

}  // namespace clerestory
