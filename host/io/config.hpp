// Typed configuration: TOML files that extend each other, overrides in Hydra's grammar, one schema that knows every
// key.
//
//   extends = "base.toml"            # or a list, later ones win; paths are relative to this file
//   [model]
//   width = 64
//   [[variant]]                      # a row of an ablation table
//   name = "narrow"
//   overrides = ["model.width=32"]
//
// Overrides: `a.b=1` changes a key that has a value, `+a.b=1` gives one to a key that has none, `++a.b=1` does either,
// `~a.b` takes back what files and earlier overrides said. Order: defaults, extended files, the file, the variant,
// the command line.
#pragma once
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "host/error.hpp"

namespace clerestory {

using ConfigValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                                 std::vector<double>, std::vector<std::string>>;

/// Inclusive bounds of a number, or of each number of a list.
struct Bounds {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
};

/// Every key a config may hold, with type, default, what is allowed, and a line of documentation.
/// A key named `section.*` stands for any one name in that section and has no value until one is given.
class Schema {
 public:
  struct Key {
    std::string name, doc;
    ConfigValue value = false;  // the default; for a key without one, only its type counts
    bool has_default = true;
    Bounds bounds = {};
    std::vector<std::string> choices = {};  // of a text; empty: any
    bool names_run = true;                  // part of config_hash
    bool default_names_run = true;          // its default, too
  };

  /// Heading and introduction of a section ("model") on the page of keys. Optional.
  Schema& section(const std::string& name, const std::string& doc);

  Schema& flag(const std::string& name, bool value, const std::string& doc);
  Schema& integer(const std::string& name, std::int64_t value, const std::string& doc, Bounds bounds = {});
  Schema& real(const std::string& name, double value, const std::string& doc, Bounds bounds = {});
  Schema& text(const std::string& name, const std::string& value, const std::string& doc,
               std::vector<std::string> choices = {});
  Schema& integers(const std::string& name, std::vector<std::int64_t> value, const std::string& doc,
                   Bounds bounds = {});
  Schema& reals(const std::string& name, std::vector<double> value, const std::string& doc, Bounds bounds = {});
  Schema& texts(const std::string& name, std::vector<std::string> value, const std::string& doc,
                std::vector<std::string> choices = {});

  /// The key declared last gets no default: `has` tells whether the config gives it.
  Schema& optional();
  /// The key declared last does not change results (an output folder, a log interval, the seed that a run directory
  /// names by itself): it stays out of config_hash.
  Schema& aside();
  /// The key declared last came later than results that are kept, which its default changes nothing of: only another
  /// value is part of config_hash.
  Schema& later();
  /// Takes in all keys and sections of another schema.
  Schema& include(const Schema& other);

  const std::map<std::string, Key>& keys() const { return keys_; }
  const std::map<std::string, std::string>& sections() const { return sections_; }
  /// The key that describes `name`, by itself or as `section.*`; null when there is none.
  const Key* find(std::string_view name) const;
  /// The known name closest to a misspelt one.
  std::string nearest(std::string_view name) const;

 private:
  Schema& add(Key key);
  std::map<std::string, Key> keys_;
  std::map<std::string, std::string> sections_;
  std::string last_;
};

/// Where a value came from: "file.toml:12", "model.width=64", or "default".
struct ConfigEntry {
  ConfigValue value;
  std::string origin;
};

struct ConfigVariant {
  std::string name;   // letters, digits, - _ . +: it becomes part of a folder's name
  std::string label;  // for tables; the name when none is given
  std::vector<std::string> overrides;
  std::string origin;
};

/// A resolved, checked config. Reading a key that the schema lacks, or with the wrong type, is an error of the program
/// and throws ErrorKind::Failed.
class Config {
 public:
  /// All defaults, then overrides.
  explicit Config(const Schema& schema, const std::vector<std::string>& overrides = {});

  bool has(std::string_view key) const;
  bool flag(std::string_view key) const;
  std::int64_t integer(std::string_view key) const;
  int whole(std::string_view key) const;  // the same where the key's bounds fit into an int
  double real(std::string_view key) const;
  const std::string& text(std::string_view key) const;
  const std::vector<std::int64_t>& integers(std::string_view key) const;
  const std::vector<double>& reals(std::string_view key) const;
  const std::vector<std::string>& texts(std::string_view key) const;

  /// Where the value was set: "file.toml:12", "model.width=64" or "default".
  std::string origin(std::string_view key) const;
  /// "key (origin)", for messages about values that do not go together.
  std::string where(std::string_view key) const;

  const std::vector<ConfigVariant>& variants() const { return variants_; }
  /// This config as the named variant: its overrides lie between the files and the command line.
  Config variant(std::string_view name) const;
  /// This config with further overrides, as if they had been given last.
  Config with(const std::vector<std::string>& overrides) const;

  const Schema& schema() const { return *schema_; }
  const std::map<std::string, ConfigEntry>& entries() const { return entries_; }

 private:
  friend Config load_config(const std::filesystem::path&, const Schema&, const std::vector<std::string>&);
  friend Config parse_config(std::string_view, const std::string&, const Schema&, const std::vector<std::string>&);
  Config() = default;
  void rebuild();
  void apply(const std::string& override_text, const std::string& origin);
  template <class T>
  const T& get(std::string_view key) const;

  std::shared_ptr<const Schema> schema_;
  std::map<std::string, ConfigEntry> from_files_, entries_;
  std::vector<ConfigVariant> variants_;
  std::optional<ConfigVariant> chosen_;
  std::vector<std::string> overrides_;
};

/// Reads `path` and everything it extends, applies `overrides`, checks every key. Throws ErrorKind::Usage: file, line
/// and key; the nearest known key for an unknown one; the chain of files for a cycle.
Config load_config(const std::filesystem::path& path, const Schema& schema,
                   const std::vector<std::string>& overrides = {});

/// The same for a text that is no file (a config stored with weights); `extends` is refused. `name` is for messages.
Config parse_config(std::string_view toml, const std::string& name, const Schema& schema,
                    const std::vector<std::string>& overrides = {});

/// All keys and values as TOML, sorted, without variants. Loading it gives the same config.
std::string config_toml(const Config& config);

/// Eight hexadecimal digits of everything that changes results (keys not declared `aside`; `later`).
std::string config_hash(const Config& config);

/// The page of all keys in Markdown: a table of key, type, default, allowed, meaning for every section.
std::string config_page(const Schema& schema, const std::string& title);

/// One Cartesian product of overrides: `lr=1e-3,1e-4 seed=range(0,3)` gives six lists, the last one varying fastest.
/// Commas inside brackets or quotes do not split; range(a,b) counts from a up to b - 1.
std::vector<std::vector<std::string>> expand_sweep(const std::vector<std::string>& overrides);

}  // namespace clerestory
