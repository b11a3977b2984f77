#include "experiments/results/result.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "experiments/studies/study.hpp"
#include "host/error.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/io/nesting.hpp"
#include "host/report/plot.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Texts = std::vector<std::string>;

constexpr double kManyfold = 20;  // a plot that spans more than this has a log axis

// ---- From a run ----

/// Relative to the tree, as a path of any machine. Relative ones count from the tree, where the scripts run.
std::string in_tree(const fs::path& path, const fs::path& tree, const std::string& what) {
  const fs::path root = fs::weakly_canonical(tree);
  const fs::path inside = fs::weakly_canonical(root / path).lexically_relative(root);
  if (inside.empty() || *inside.begin() == "..")
    throw usage_error(what + " lies outside of the source tree", path.string(), {}, "a file that others have too");
  return inside.generic_string();
}

/// Keys that change no figure.
constexpr std::array<std::string_view, 4> kNoFigure{"run.root", "run.device", "run.tile", "run.gemm"};

std::string key_of(const std::string& word) { return word.substr(0, word.find('=')); }

ResultCommand command_of(const Provenance& provenance, const std::string& run, const fs::path& tree) {
  const Texts& words = provenance.command;
  if (words.size() < 3 || words[1] != "run")
    throw usage_error("not made by `clerestory run CONFIG`", run, command_text(words), "a run of a study");
  ResultCommand command;
  command.config = in_tree(words[2], tree, "the config");
  for (std::size_t i = 3; i < words.size(); ++i) {
    if (words[i] == "--device" || words[i] == "--gemm") {
      ++i;  // the fingerprint tells the device; who multiplies changes roundings
    } else if (words[i] == "-m") {
      command.many = true;
    } else if (std::ranges::count(kNoFigure, key_of(words[i])) == 0) {
      command.overrides.push_back(words[i]);
    }
  }
  return command;
}

/// What all of it was made with: not what the command sweeps, nor the rooms of trainings, which a study of them makes
/// itself. What a variant sets stands by its name.
std::map<std::string, std::string> settings_of(const Config& config, const Texts& overrides) {
  std::map<std::string, std::string> settings;
  for (const auto& [key, entry] : config.entries())
    if (entry.origin != "default" && config.schema().find(key)->names_run) settings[key] = toml_value(entry.value);
  for (const std::string& word : overrides)
    if (expand_sweep({word}).size() > 1) settings.erase(key_of(word));
  if (settings.contains("ablation.data_seed"))
    for (const char* key : {"data.train", "data.validation", "data.validation_split"}) settings.erase(key);
  for (const ConfigVariant& variant : config.variants())
    if (!variant.overrides.empty())
      settings["variant " + variant.name] = fmt::format("{}", fmt::join(variant.overrides, " "));
  return settings;
}

std::map<std::string, std::string> kernels_of(const Provenance& provenance, const std::string& run) {
  std::map<std::string, std::string> kernels;
  for (const auto& [what, hash] : provenance.hashes)
    if (what.starts_with("kernels/")) kernels[what] = hash;
  if (kernels.empty()) throw usage_error("does not tell which kernels it took", run, {}, "a run of this version");
  return kernels;
}

const Column& column_named(const Table& table, const std::string& where, const std::string& name) {
  const auto found = std::ranges::find(table.columns, name, &Column::name);
  if (found != table.columns.end()) return *found;
  Texts names;
  for (const Column& column : table.columns) names.push_back(column.name);
  throw usage_error("no such column to plot", where, name, fmt::format("{}", fmt::join(names, ", ")));
}

bool has_numbers(const Table& table, std::size_t column) {
  return std::ranges::any_of(table.rows, [&](const auto& row) { return std::holds_alternative<Measure>(row[column]); });
}

/// The asked table and column; where nothing is asked the first whose best is marked, then the first with numbers.
PlottedColumn plotted_of(const RunTables& tables, const PlottedColumn& asked, const std::string& run) {
  if (!asked.table.empty() && !tables.contains(asked.table)) {
    Texts names;
    for (const auto& [name, table] : tables) names.push_back(name);
    throw usage_error("no such table to plot", run, asked.table, fmt::format("{}", fmt::join(names, ", ")));
  }
  for (const bool marked : {true, false})
    for (const auto& [name, table] : tables) {
      if (!asked.table.empty() && name != asked.table) continue;
      if (!asked.column.empty()) {
        if (!asked.table.empty() || std::ranges::count(table.columns, asked.column, &Column::name) > 0)
          return {name, column_named(table, run + ": " + name, asked.column).name};
        continue;
      }
      for (std::size_t c = 0; c < table.columns.size(); ++c)
        if (has_numbers(table, c) && (!marked || table.columns[c].best != Best::None))
          return {name, table.columns[c].name};
    }
  throw usage_error("no table has such a column to plot", run, asked.column, "a column with numbers");
}

/// The first word that is an absolute path, or nothing. Words end where a path with a blank would be quoted.
std::string machine_path(const std::string& text) {
  const std::string before = " \"'=(,[", end = before + ")]";
  for (std::size_t at = 0; (at = text.find('/', at)) != std::string::npos; ++at) {
    if (at > 0 && before.find(text[at - 1]) == std::string::npos) continue;
    const std::string word = text.substr(at, text.find_first_of(end, at) - at);
    if (word.size() > 1 && word.find('/', 1) != std::string::npos) return word;
  }
  return {};
}

std::string without(std::string text, const std::string& part) {
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos;) text.erase(at, part.size());
  return text;
}

// ---- JSON ----

Json json_of(const Result& r) {
  Json inputs = Json::array(), tables = Json::object();
  for (const FileRecord& file : r.inputs)
    inputs.push_back({{"path", file.path}, {"bytes", file.bytes}, {"hash", file.hash}});
  for (const auto& [name, table] : r.tables) tables[name] = Json::parse(table_json(table));
  return {{"name", r.name},
          {"title", r.title},
          {"command", r.command.text()},
          {"config",
           {{"file", r.command.config},
            {"overrides", r.command.overrides},
            {"many", r.command.many},
            {"hash", r.config_hash},
            {"settings", r.settings}}},
          {"kernels", r.kernels},
          {"inputs", inputs},
          {"rooms", {{"setting", r.rooms.setting}, {"seeds", r.rooms.seeds}}},
          {"seeds", r.seeds},
          {"commit", r.commit},
          {"device", r.device},
          {"minutes", r.minutes},
          {"notes", r.notes},
          {"plot", {{"table", r.plotted.table}, {"column", r.plotted.column}}},
          {"tables", tables}};
}

// ---- Markdown and plot ----

std::string row_of(const std::string& name, std::string value) {
  for (std::size_t at = 0; (at = value.find('|', at)) != std::string::npos; at += 2) value.insert(at, "\\");
  return "| " + name + " | " + value + " |\n";
}

std::string pairs_text(const std::map<std::string, std::string>& pairs) {
  Texts words;
  for (const auto& [key, value] : pairs) words.push_back(key + " = " + value);
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string head_of(const Result& r) {
  std::string head = "| | |\n|---|---|\n";
  head += row_of("command", "`" + r.command.text() + "`");
  if (!r.rooms.seeds.empty())
    head += row_of("rooms", fmt::format("{} of the setting {}; their seeds are in {}.json", r.rooms.seeds.size(),
                                        r.rooms.setting, r.name));
  if (!r.seeds.empty()) {
    Texts seeds;
    for (const auto& [key, value] : r.seeds) seeds.push_back(fmt::format("{} = {}", key, value));
    head += row_of("seeds", fmt::format("{}", fmt::join(seeds, ", ")));
  }
  if (!r.settings.empty()) head += row_of("settings", pairs_text(r.settings));
  for (const auto& [name, value] : r.notes) head += row_of(name, value);
  for (const FileRecord& file : r.inputs) head += row_of(file.path, "hash " + file.hash);
  head += row_of("hash of the config", r.config_hash);
  head += row_of("kernels", fmt::format("{} sources; their hashes are in {}.json", r.kernels.size(), r.name));
  return head + row_of("made by", fmt::format("commit {}, in {:.1f} minutes, on {}", r.commit, r.minutes, r.device));
}

std::string label_of(const std::vector<Cell>& row) {
  Texts words;
  for (const Cell& cell : row)
    if (const auto* text = std::get_if<std::string>(&cell)) words.push_back(*text);
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

std::string ResultCommand::text() const {
  Texts words{"clerestory", "run", config};
  words.insert(words.end(), overrides.begin(), overrides.end());
  if (many) words.push_back("-m");
  return command_text(words);
}

Result result_of_run(const fs::path& run, const std::string& name, const std::string& title,
                     const PlottedColumn& plotted, const fs::path& tree) {
  if (!fs::is_directory(run)) throw usage_error("no such folder", run.string(), {}, "a run of `clerestory run`");
  if (!fs::exists(run / "DONE")) throw usage_error("this run is not done", run.string(), {}, "a finished one");
  const Provenance provenance = read_provenance(run / "provenance.json");
  Result r;
  r.name = name, r.title = title;
  r.command = command_of(provenance, run.string(), tree);
  const Config config = study_config(tree / r.command.config, r.command.overrides);
  r.config_hash = study_hash(tree / r.command.config, r.command.overrides, r.command.many);
  const auto config_then = provenance.hashes.find("config");
  const std::string then = config_then == provenance.hashes.end() ? "none" : config_then->second;
  if (then != r.config_hash)
    throw usage_error("this run was made with another config than the file holds now",
                      run.string() + ": " + r.command.config, r.config_hash, then);
  r.kernels = kernels_of(provenance, run.string());
  r.settings = settings_of(config, r.command.overrides);
  r.commit = provenance.build.commit + (provenance.build.dirty ? " (changed)" : "");
  r.device = provenance.device;
  for (const FileRecord& file : provenance.inputs)
    r.inputs.push_back({in_tree(file.path, tree, "what this run rests on"), file.hash, file.bytes});
  r.rooms = provenance.rooms, r.seeds = provenance.seeds;
  const std::string root = fs::weakly_canonical(tree).string() + "/";
  for (const auto& [fact, value] : provenance.facts) r.notes[fact] = without(value, root);
  if (const auto minutes = provenance.figures.find("minutes"); minutes != provenance.figures.end())
    r.minutes = std::round(10 * minutes->second) / 10;
  r.tables = study_tables(run);
  r.tables.erase("runs");  // a sweep's list of folders
  r.plotted = plotted_of(r.tables, plotted, run.string());
  if (const std::string path = machine_path(result_json(r)); !path.empty())
    throw usage_error("a result would name a path of this machine", run.string(), path, "paths in the source tree");
  return r;
}

std::string result_json(const Result& result) { return json_of(result).dump(1) + "\n"; }

Result read_result(const fs::path& path) {
  const std::string where = path.string(), text = read_file(path, std::uint64_t{16} << 20);
  check_nesting(text, where);
  try {
    const Json json = Json::parse(text);
    Result r;
    json.at("name").get_to(r.name), json.at("title").get_to(r.title);
    const Json& config = json.at("config");
    config.at("file").get_to(r.command.config), config.at("overrides").get_to(r.command.overrides);
    config.at("many").get_to(r.command.many), config.at("hash").get_to(r.config_hash);
    config.at("settings").get_to(r.settings);
    json.at("kernels").get_to(r.kernels);
    for (const Json& file : json.at("inputs"))
      r.inputs.push_back({file.at("path").get<std::string>(), file.at("hash").get<std::string>(),
                          whole_number<std::uintmax_t>(file.at("bytes"), "bytes", where)});
    json.at("rooms").at("setting").get_to(r.rooms.setting);
    for (const Json& seed : json.at("rooms").at("seeds"))
      r.rooms.seeds.push_back(whole_number<std::uint64_t>(seed, "seeds", where));
    for (const auto& [name, seed] : json.at("seeds").items())
      r.seeds[name] = whole_number<std::uint64_t>(seed, name, where);
    json.at("commit").get_to(r.commit), json.at("device").get_to(r.device), json.at("minutes").get_to(r.minutes);
    json.at("notes").get_to(r.notes);
    json.at("plot").at("table").get_to(r.plotted.table), json.at("plot").at("column").get_to(r.plotted.column);
    for (const auto& [name, table] : json.at("tables").items())
      r.tables[name] = table_from_json(table.dump(), path.string() + ": " + name);
    return r;
  } catch (const Json::exception& error) {
    throw usage_error(std::string("not a result: ") + error.what(), path.string());
  }
}

std::string result_markdown(const Result& result) {
  std::string text = "# " + result.title + "\n\n";
  text += fmt::format(
      "Made from {0}.json by `clerestory results`; `bash experiments/reproduce/{0}.sh` measures it at full size, and "
      "the "
      "row `command` says what was run for these figures.\n\n",
      result.name);
  text += head_of(result);
  for (const auto& [name, table] : result.tables) text += "\n" + table_markdown(table);
  return text + fmt::format("\n![{}: {}]({}.svg)\n", result.plotted.table, result.plotted.column, result.name);
}

std::string result_svg(const Result& result) {
  const Table& table = result.tables.at(result.plotted.table);
  const Column& column = column_named(table, result.name + ": " + result.plotted.table, result.plotted.column);
  const auto index = static_cast<std::size_t>(&column - table.columns.data());
  DotPlot plot;
  plot.title = result.title;
  plot.x_label = column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit);
  double least = INFINITY, most = 0;
  for (const auto& row : table.rows) {
    const auto* measure = std::get_if<Measure>(&row[index]);
    if (!measure || !std::isfinite(measure->mean)) continue;
    plot.dots.push_back({label_of(row), measure->mean, measure->count > 1 ? measure->deviation : 0});
    least = std::min(least, measure->mean), most = std::max(most, measure->mean);
  }
  plot.log_x = least > 0 && most > kManyfold * least;
  return plot_svg(plot) + plot_mark(result);
}

std::string plot_mark(const Result& result) {
  const std::string drawn =
      result.title + "\n" + result.plotted.column + "\n" + table_json(result.tables.at(result.plotted.table));
  return fmt::format("<!-- drawn from figures {:016x} -->\n", content_hash(drawn));
}

fs::path results_folder(const fs::path& tree) { return tree / "docs/results"; }

fs::path result_file(const fs::path& tree, const std::string& name) { return results_folder(tree) / (name + ".json"); }

std::vector<std::string> result_names(const fs::path& tree) {
  Texts names;
  if (fs::is_directory(results_folder(tree)))
    for (const auto& entry : fs::directory_iterator(results_folder(tree)))
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

void write_result(const Result& result, const fs::path& tree) {
  const std::string svg = result_svg(result), markdown = result_markdown(result), json = result_json(result);
  make_directories(results_folder(tree));
  const fs::path file = result_file(tree, result.name);
  write_file(file, json);
  write_file(fs::path(file).replace_extension(".md"), markdown);
  write_file(fs::path(file).replace_extension(".svg"), svg);
}

}  // namespace clerestory
