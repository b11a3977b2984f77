#include "tracer/manifest.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/error.hpp"
#include "host/io/config.hpp"
#include "host/io/config_values.hpp"
#include "host/io/data_files.hpp"
#include "host/io/files.hpp"
#include "tracer/views.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, kViewMeans> kMeans{"albedo",   "roughness", "metallic", "normal_x", "normal_y",
                                                     "normal_z", "depth",     "radiance", "light"};
constexpr std::array<const char*, 3> kSplits{"train", "val", "test"};
constexpr const char* kSettings[] = {"training", "held_out"};
constexpr std::uint64_t kMostBytes = 1u << 20;

std::string within_of(const char* mean) { return std::string(mean) + "_within"; }

/// No key has a default: what fixes pixels stands in the file.
Schema schema() {
  constexpr double kMostRooms = 4000;  // of a file of rooms, some 60 kB each before they are packed
  Schema s;
  s.text("name", "", "what the set is called").optional();
  s.integer("version", 1, "a set of other rooms or pixels is another version", {1, 1e6}).optional();
  s.integer("views.count", 1, "views of a room", {1, 1000}).optional();
  s.integer("views.width", 16, "pixels", {16, 4096}).optional();
  s.integer("views.height", 16, "pixels", {16, 4096}).optional();
  s.integer("views.spp", 1, "samples of a pixel", {1, 1 << 20}).optional();
  s.real("views.clamp", 0, "as --clamp", {0, 1e6}).optional();
  s.real("views.roll", 0, "as --roll", {0, 45}).optional();
  s.real("views.close_ups", 0, "as --close-ups", {0, 1}).optional();
  s.real("views.from_above", 0, "as --from-above", {0, 1}).optional();
  s.flag("light.wanted", true, "environment maps and probes too").optional();
  s.integer("light.spp", 1, "as --light-spp", {1, 1 << 12}).optional();
  s.integer("light.probes", 0, "as --probes", {0, 100}).optional();
  s.integer("expected.version", 1, "for which all below was written", {1, 1e6}).optional();
  s.text("expected.assets", "", "hash of panoramas and models").optional();
  for (const std::string split : kSplits) {
    s.integer(split + ".rooms", 1, "rooms, by the rules", {1, kMostRooms}).optional();
    s.integer(split + ".seed", 0, "rooms of different seeds share nothing", {0, 1e15}).optional();
    s.text(split + ".setting", "training", "as --setting", {kSettings[0], kSettings[1]}).optional();
    const std::string expected = split + ".expected.";
    s.text(expected + "rooms", "", "hash of their descriptions").optional();
    s.text(expected + "cameras", "", "a letter for each view, room by room: which candidate it is").optional();
    for (const char* mean : kMeans) {
      s.reals(expected + mean, {}, "mean over each of the first views").optional();
      s.reals(expected + within_of(mean), {}, "how far another device's may lie", {0, 1e300}).optional();
    }
  }
  return s;
}

/// Reads keys that must be there.
class Keys {
 public:
  Keys(const Config& config, const fs::path& file) : config_(config), file_(file.string()) {}

  int integer(const std::string& key) const { return static_cast<int>(need(key).integer(key)); }
  double real(const std::string& key) const { return need(key).real(key); }
  bool flag(const std::string& key) const { return need(key).flag(key); }
  const std::string& text(const std::string& key) const { return need(key).text(key); }
  std::uint64_t seed(const std::string& key) const { return static_cast<std::uint64_t>(need(key).integer(key)); }
  const std::vector<double>& reals(const std::string& key) const { return need(key).reals(key); }

  /// Whether any key begins so.
  bool any(const std::string& beginning) const {
    return std::ranges::any_of(config_.entries(), [&](const auto& e) { return e.first.starts_with(beginning); });
  }
  [[noreturn]] void refuse(const std::string& what, const std::string& key, const std::string& found,
                           const std::string& expected) const {
    throw usage_error(key + " " + what, config_.has(key) ? config_.origin(key) : file_, found, expected);
  }

 private:
  const Config& need(const std::string& key) const {
    if (!config_.has(key)) refuse("is missing", key, "", type_words(config_.schema().find(key)->value));
    return config_;
  }
  const Config& config_;
  std::string file_;
};

std::string hash_key(const Keys& keys, const std::string& key) {
  const std::string& hash = keys.text(key);
  if (hash.size() != 16 || hash.find_first_not_of("0123456789abcdef") != std::string::npos)
    keys.refuse("is no hash", key, "'" + hash + "'", "16 hexadecimal digits");
  return hash;
}

std::vector<int> read_cameras(const Keys& keys, const std::string& key, std::size_t views) {
  const std::string& letters = keys.text(key);
  if (letters.size() != views)
    keys.refuse("has another length", key, fmt::format("{} letters", letters.size()),
                fmt::format("{}, one for each view of each room", views));
  std::vector<int> cameras;
  for (const char c : letters) {
    if (c < 'a' || c >= 'a' + kViewCandidates)
      keys.refuse("has a letter of no camera", key, fmt::format("'{}'", c),
                  fmt::format("a to {}", static_cast<char>('a' + kViewCandidates - 1)));
    cameras.push_back(c - 'a');
  }
  return cameras;
}

std::vector<ViewMeans> read_means(const Keys& keys, const std::string& section, std::size_t most) {
  std::vector<ViewMeans> views;
  for (std::size_t m = 0; m < kMeans.size(); ++m) {
    const std::string key = section + kMeans[m], within = section + within_of(kMeans[m]);
    const std::vector<double>&values = keys.reals(key), &most_off = keys.reals(within);
    if (m == 0) {
      if (values.empty() || values.size() > most)
        keys.refuse("has another length", key, fmt::format("{}", values.size()), fmt::format("1 to {}", most));
      views.resize(values.size());
    }
    for (const auto& [name, list] : {std::pair{&key, &values}, std::pair{&within, &most_off}})
      if (list->size() != views.size())
        keys.refuse("has another length", *name, fmt::format("{}", list->size()), fmt::format("{}", views.size()));
    for (std::size_t v = 0; v < views.size(); ++v) views[v][m] = {values[v], most_off[v]};
  }
  return views;
}

void read_fixed(Manifest& m, const Keys& keys) {
  m.name = keys.text("name"), m.version = keys.integer("version");
  m.views.count = keys.integer("views.count"), m.views.spp = keys.integer("views.spp");
  m.views.width = keys.integer("views.width"), m.views.height = keys.integer("views.height");
  m.views.clamp = keys.real("views.clamp"), m.views.handling.roll = keys.real("views.roll");
  m.views.handling.close_ups = keys.real("views.close_ups");
  const std::string above = "views.from_above";  // sets of before there was any have none
  if (keys.any(above)) m.views.handling.from_above = keys.real(above);
  m.light.wanted = keys.flag("light.wanted");
  m.light.spp = keys.integer("light.spp"), m.light.probes = keys.integer("light.probes");
  for (const std::string name : kSplits) {
    if (!keys.any(name + ".")) continue;
    SetSplit split;
    split.name = name, split.rooms = keys.integer(name + ".rooms"), split.seed = keys.seed(name + ".seed");
    split.setting = keys.text(name + ".setting") == kSettings[1] ? Setting::HeldOut : Setting::Training;
    for (const SetSplit& other : m.splits)
      if (other.seed == split.seed && other.setting == split.setting)
        keys.refuse("gives the rooms of " + other.name, name + ".seed", fmt::format("{}", split.seed), "another seed");
    m.splits.push_back(std::move(split));
  }
  if (m.splits.empty())
    keys.refuse("is missing, and val and test too", "train", "", "[train] with rooms, seed, setting");
}

void read_expected(Manifest& m, const Keys& keys) {
  m.expected_version = keys.integer("expected.version");
  if (m.expected_version != m.version)
    keys.refuse("is that of another version", "expected.version", fmt::format("{}", m.expected_version),
                fmt::format("{}: `clerestory generate --manifest FILE --write-expected` writes it", m.version));
  m.assets_hash = hash_key(keys, "expected.assets");
  for (SetSplit& split : m.splits) {
    const std::string section = split.name + ".expected.";
    const std::size_t views = static_cast<std::size_t>(split.rooms) * static_cast<std::size_t>(m.views.count);
    split.rooms_hash = hash_key(keys, section + "rooms");
    split.cameras = read_cameras(keys, section + "cameras", views);
    split.views = read_means(keys, section, views);
  }
}

/// Lines of comment, and empty ones, that the file begins with.
std::string comment_of(const fs::path& file) {
  const std::string text = read_file(file, kMostBytes, true);
  std::size_t end = 0;
  while (end < text.size() && (text[end] == '#' || text[end] == '\n')) {
    const std::size_t line = text.find('\n', end);
    end = line == std::string::npos ? text.size() : line + 1;
  }
  return text.substr(0, end);
}

/// What must come out, as overrides of a config.
std::vector<std::string> expected_keys(const Manifest& m) {
  std::vector<std::string> all;
  const auto set = [&](const std::string& key, const ConfigValue& value) {
    all.push_back("++" + key + "=" + toml_value(value));
  };
  set("expected.version", std::int64_t{m.expected_version}), set("expected.assets", m.assets_hash);
  for (const SetSplit& split : m.splits) {
    const std::string section = split.name + ".expected.";
    std::string letters;
    for (const int camera : split.cameras) letters += static_cast<char>('a' + camera);
    set(section + "rooms", split.rooms_hash), set(section + "cameras", letters);
    for (std::size_t k = 0; k < kMeans.size(); ++k) {
      std::vector<double> values, within;
      for (const ViewMeans& view : split.views) values.push_back(view[k].value), within.push_back(view[k].within);
      set(section + kMeans[k], values), set(section + within_of(kMeans[k]), within);
    }
  }
  return all;
}

}  // namespace

const char* key_of(ViewMean mean) { return kMeans.at(static_cast<std::size_t>(mean)); }

Manifest read_manifest(const fs::path& file, bool expected) {
  Manifest m;
  m.file = found_data(file);
  const Config config = load_config(m.file, schema());
  const Keys keys(config, m.file);
  read_fixed(m, keys);
  if (expected)
    read_expected(m, keys);
  else if (keys.any("expected.version"))
    m.expected_version = keys.integer("expected.version");
  return m;
}

std::string manifest_text(const Manifest& manifest) {
  return comment_of(manifest.file) + config_toml(load_config(manifest.file, schema(), expected_keys(manifest)));
}

std::string hash_of(const RoomFile& rooms) { return fmt::format("{:016x}", content_hash(columns_of(rooms))); }

}  // namespace clerestory
