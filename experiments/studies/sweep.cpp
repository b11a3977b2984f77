#include "experiments/studies/sweep.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "host/error.hpp"
#include "host/io/config_values.hpp"
#include "host/io/files.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/html.hpp"
#include "host/report/progress.hpp"
#include "host/report/run_directory.hpp"
#include "host/report/shared_text.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

/// "++model.width=64" to "model.width" and "64".
std::string key_of(const std::string& word) {
  const auto from = word.find_first_not_of("+~");
  return from == std::string::npos ? word : word.substr(from, word.find('=') - from);
}
std::string value_of(const std::string& word) { return word.substr(word.find('=') + 1); }

bool is_seed(const std::string& key) { return key == "seed" || key.ends_with(".seed"); }

struct Plan {
  Texts keys;  // swept ones
  std::vector<Config> configs;
  std::vector<SweptRun> runs;
};

fs::path folder_of(const Config& c) {
  return RunDirectory::path_of(c.text("run.root"), c.text("run.experiment"), c.text("run.variant"), c,
                               static_cast<std::uint64_t>(c.integer("run.seed")));
}

Plan plan_of(const fs::path& path, const Schema& schema, const Texts& words, const Texts& fixed) {
  const Config base = load_config(path, schema);
  Plan plan;
  if (!base.variants().empty()) plan.keys.push_back("variant");
  std::vector<std::size_t> swept;
  for (std::size_t i = 0; i < words.size(); ++i)
    if (expand_sweep({words[i]}).size() > 1) swept.push_back(i), plan.keys.push_back(key_of(words[i]));

  std::set<fs::path> folders;
  const auto add = [&](const Config& config, const Texts& overrides, Texts values) {
    for (const std::size_t i : swept) values.push_back(value_of(overrides[i]));
    const Config& run = plan.configs.emplace_back(config.with(overrides).with(fixed));
    plan.runs.push_back({std::move(values), folder_of(run), "", {}});
    if (!folders.insert(plan.runs.back().folder).second)
      throw usage_error("two runs of the sweep would be the same", plan.runs.back().folder.string(),
                        fmt::format("{}", fmt::join(overrides, " ")), "values that make another run");
  };
  for (const Texts& overrides : expand_sweep(words)) {
    if (base.variants().empty()) add(base, overrides, {});
    for (const ConfigVariant& v : base.variants())
      add(base.variant(v.name).with({"run.variant=" + v.name}), overrides, {v.label});
  }
  return plan;
}

std::string description(const Texts& keys, const SweptRun& run) {
  Texts pairs;
  for (std::size_t i = 0; i < keys.size(); ++i) pairs.push_back(keys[i] + "=" + run.values[i]);
  return fmt::format("{}", fmt::join(pairs, " "));
}

/// Of all that failed, where it is one kind: what the sweep then ends with.
ErrorKind kind_of_failures(const std::vector<SweptRun>& runs) {
  std::set<ErrorKind> kinds;
  for (const SweptRun& run : runs)
    if (!run.failure.empty() && !run.elsewhere) kinds.insert(run.failed_by);
  return kinds.size() == 1 ? *kinds.begin() : ErrorKind::Failed;
}

void run_one(const SweepTask& task, const Config& config, SweptRun& run) {
  run.failure.clear(), run.elsewhere = false;
  try {
    task.run(config);
    run.tables = task.results(run.folder);
  } catch (const AtWork& e) {
    run.failure = e.what(), run.elsewhere = true;
    say("sweep: this run is left to another process: " + run.failure);
  } catch (const std::exception& e) {
    const auto* error = dynamic_cast<const Error*>(&e);
    if (error && error->kind() == ErrorKind::Interrupted) throw;
    run.failure = e.what(), run.failed_by = error ? error->kind() : ErrorKind::Failed;
    say("sweep: this run failed: " + run.failure);
  }
}

/// One after another; in the end those again that others were at work on: they may be done by now, or free.
void run_all(const SweepTask& task, Plan& plan) {
  const std::size_t count = plan.runs.size();
  for (const bool again : {false, true})
    for (std::size_t i = 0; i < count; ++i) {
      if (again && !plan.runs[i].elsewhere) continue;
      stop_if_interrupted(fmt::format("sweep, after {} of {} runs", i, count));
      say(fmt::format("sweep: run {} of {}{}: {}", i + 1, count, again ? " again" : "",
                      description(plan.keys, plan.runs[i])));
      run_one(task, plan.configs[i], plan.runs[i]);
    }
}

std::vector<SweptPoint> points_of(const Texts& keys, const std::vector<SweptRun>& runs) {
  std::vector<SweptPoint> points;
  for (const SweptRun& run : runs) {
    Texts values;
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (!is_seed(keys[i])) values.push_back(run.values[i]);
    auto point = std::ranges::find(points, values, &SweptPoint::values);
    if (point == points.end()) point = points.insert(points.end(), {values, {}});
    point->runs.push_back(&run);
  }
  return points;
}

/// What tells a row from others of its table: its words, and how often they came before.
using RowName = std::pair<Texts, int>;

std::vector<RowName> row_names(const Table& table) {
  std::vector<RowName> names;
  for (const auto& row : table.rows) {
    RowName name;
    for (const Cell& cell : row)
      if (const auto* text = std::get_if<std::string>(&cell)) name.first.push_back(*text);
    for (const RowName& before : names) name.second += before.first == name.first;
    names.push_back(std::move(name));
  }
  return names;
}

Cell merged(const std::vector<Cell>& cells) {
  if (cells.size() == 1) return cells[0];
  std::vector<double> means;
  for (const Cell& cell : cells) {
    if (std::holds_alternative<std::string>(cell)) return cell;
    if (const auto* m = std::get_if<Measure>(&cell)) means.push_back(m->mean);
  }
  if (std::ranges::none_of(means, [](double v) { return std::isfinite(v); })) return {};
  return measure_of(means);  // one that is not finite shows
}

/// A row of some runs put together.
struct MergedRow {
  RowName name;
  std::vector<std::vector<Cell>> cells;  // [column][run]
  std::size_t runs = 0;                  // that have it
};

/// Rows of a point's runs put together. What a run has beyond those before it stands behind the row that it follows
/// there.
std::vector<MergedRow> merged_rows(const std::vector<const Table*>& tables) {
  std::vector<MergedRow> rows;
  for (const Table* table : tables) {
    const std::vector<RowName> own = row_names(*table);
    auto next = rows.begin();
    for (std::size_t r = 0; r < own.size(); ++r) {
      auto found = std::ranges::find(rows, own[r], &MergedRow::name);
      if (found == rows.end())
        found = rows.insert(next, {own[r], std::vector<std::vector<Cell>>(table->columns.size())});
      for (std::size_t c = 0; c < found->cells.size(); ++c) found->cells[c].push_back(table->rows[r][c]);
      ++found->runs;
      next = found + 1;
    }
  }
  return rows;
}

Texts names_of(const std::vector<Column>& columns) {
  Texts names;
  for (const Column& c : columns) names.push_back(c.name);
  return names;
}

Table stacked(const std::string& name, const Texts& keys, const std::vector<SweptPoint>& points) {
  Table out;
  bool counted = false;
  std::vector<Column> columns;
  for (const SweptPoint& point : points) {
    counted = counted || point.runs.size() > 1;
    for (const SweptRun* run : point.runs) {
      const auto found = run->tables.find(name);
      counted = counted || found == run->tables.end();
      if (found == run->tables.end()) continue;
      if (columns.empty())
        out.title = found->second.title, out.note = found->second.note, columns = found->second.columns;
      if (names_of(found->second.columns) != names_of(columns))
        throw Error(ErrorKind::Failed, "tables of one name have other columns", run->folder.string() + ": " + name,
                    fmt::format("{}", fmt::join(names_of(found->second.columns), ", ")),
                    fmt::format("{}", fmt::join(names_of(columns), ", ")));
    }
  }
  for (const std::string& key : keys)
    if (!is_seed(key)) out.columns.push_back({key});
  if (counted) out.columns.push_back({"runs"});
  out.columns.insert(out.columns.end(), columns.begin(), columns.end());

  for (const SweptPoint& point : points) {
    std::vector<const Table*> tables;
    for (const SweptRun* run : point.runs)
      if (const auto found = run->tables.find(name); found != run->tables.end()) tables.push_back(&found->second);
    const auto add = [&](std::size_t runs, const std::vector<Cell>& row) {
      std::vector<Cell> whole(point.values.begin(), point.values.end());
      if (counted) whole.emplace_back(fmt::format("{} of {}", runs, point.runs.size()));
      whole.insert(whole.end(), row.begin(), row.end());
      out.add(std::move(whole));
    };
    const std::vector<MergedRow> rows = merged_rows(tables);
    if (rows.empty()) add(tables.size(), std::vector<Cell>(columns.size()));
    for (const MergedRow& row : rows) {
      std::vector<Cell> cells;
      std::ranges::transform(row.cells, std::back_inserter(cells), merged);
      add(row.runs, cells);
    }
  }
  return out;
}

/// Every run by itself: whether it is done, and where it lies.
Table list_of(const Texts& keys, const std::vector<SweptRun>& runs) {
  Table table;
  table.title = "Runs";
  for (const std::string& key : keys) table.columns.push_back({key});
  table.columns.insert(table.columns.end(), {{"state"}, {"run"}});
  for (const SweptRun& run : runs) {
    std::vector<Cell> row(run.values.begin(), run.values.end());
    row.emplace_back(run.failure.empty() ? "done" : (run.elsewhere ? "at work: " : "failed: ") + run.failure);
    row.emplace_back(run.folder.filename().string());
    table.add(std::move(row));
  }
  return table;
}

std::string hash_of(const Plan& plan) {
  std::string names;  // of folders, which hold the hashes of configs
  for (const SweptRun& run : plan.runs) names += run.folder.filename().string() + "\n";
  return fmt::format("{:08x}", static_cast<std::uint32_t>(content_hash(names)));
}

double minutes_of(const Provenance& run) {
  if (const auto minutes = run.figures.find("minutes"); minutes != run.figures.end()) return minutes->second;
  const auto seconds = run.figures.find("seconds");  // a training's
  return seconds == run.figures.end() ? 0 : seconds->second / 60;
}

/// What the runs rest on and were made by, and how long they took, those of an earlier call too. Seeds that were swept
/// are left to the command.
void gather(Provenance& all, const std::vector<SweptRun>& runs) {
  std::set<std::string> swept, commits, devices;
  std::map<std::string, std::set<std::string>> kernels;  // by what was hashed
  double minutes = 0;
  bool dirty = false;
  for (const SweptRun& run : runs) {
    if (!fs::exists(run.folder / "provenance.json")) continue;
    const Provenance one = read_provenance(run.folder / "provenance.json");
    minutes += minutes_of(one);
    commits.insert(one.build.commit), dirty = dirty || one.build.dirty;
    devices.insert(one.device), all.facts.insert(one.facts.begin(), one.facts.end());
    for (const auto& [key, seed] : one.seeds)
      if (all.seeds.try_emplace(key, seed).first->second != seed) swept.insert(key);
    if (all.rooms.seeds.empty()) all.rooms = one.rooms;
    for (const auto& [what, hash] : one.hashes)
      if (what.starts_with("kernels")) kernels[what].insert(hash);
    for (const FileRecord& input : one.inputs) {
      const auto known = std::ranges::find(all.inputs, input.path, &FileRecord::path);
      if (known == all.inputs.end())
        all.inputs.push_back(input);
      else if (known->hash != input.hash)
        throw usage_error("the runs of this sweep read other contents of one file", input.path,
                          fmt::format("{} in {}", input.hash, run.folder.string()),
                          known->hash + " as in those before; without that folder it runs again");
    }
  }
  for (const std::string& key : swept) all.seeds.erase(key);
  all.figures["minutes"] = minutes;
  if (!commits.empty()) all.build.commit = fmt::format("{}", fmt::join(commits, ", ")), all.build.dirty = dirty;
  all.device = fmt::format("{}", fmt::join(devices, ", "));
  for (const auto& [what, hashes] : kernels) all.hashes[what] = fmt::format("{}", fmt::join(hashes, ", "));
}

fs::path folder_of(const Plan& plan) { return plan.runs[0].folder.parent_path() / ("sweep-" + hash_of(plan)); }

void write_sweep(const fs::path& folder, const Plan& plan, const SweepTask& task, const Provenance& provenance) {
  remove_tree(folder / "DONE");
  HtmlReport report(folder.parent_path().filename().string(), folder.filename().string());
  const auto write = [&](const std::string& name, const Table& table) {
    write_file(folder / (name + ".table.json"), table_json(table));
    std::printf("%s\n", table_text(table).c_str());
    report.table(without_folders(table, provenance));
  };
  Texts named;
  std::ranges::copy_if(plan.keys, std::back_inserter(named), [](const std::string& key) { return !is_seed(key); });
  const RunTables tables = sweep_tables(plan.keys, plan.runs);
  if (task.plots)
    for (const Plot& plot : task.plots(tables, named.size())) report.plot(plot);
  for (const auto& [name, table] : tables) write(name, task.finish ? task.finish(table, named.size()) : table);
  if (task.further)
    for (const auto& [name, table] : task.further(named, points_of(plan.keys, plan.runs))) write(name, table);
  write("runs", list_of(plan.keys, plan.runs));
  report.footer(provenance);
  report.write(folder / "report.html");
  write_provenance(folder / "provenance.json", provenance);
}

}  // namespace

RunTables sweep_tables(const Texts& keys, const std::vector<SweptRun>& runs) {
  std::set<std::string> names;
  for (const SweptRun& run : runs)
    for (const auto& [name, table] : run.tables) names.insert(name);
  const std::vector<SweptPoint> points = points_of(keys, runs);
  RunTables tables;
  for (const std::string& name : names) tables[name] = stacked(name, keys, points);
  return tables;
}

std::string sweep_hash(const fs::path& config, const Schema& schema, const Texts& words, const Texts& fixed) {
  return hash_of(plan_of(config, schema, words, fixed));
}

Texts sweep_names(const fs::path& config, const Schema& schema, const Texts& words, const Texts& fixed) {
  Texts names;
  for (const SweptRun& run : plan_of(config, schema, words, fixed).runs) names.push_back(run.folder.filename());
  return names;
}

std::string sweep_commands(const Texts& names, const Texts& command) {
  std::string lines;
  for (const std::string& name : names) {
    Texts words = command;
    std::erase(words, "--list");
    words.insert(words.end(), {"--only", name});
    lines += command_text(words) + "\n";
  }
  return lines;
}

fs::path run_of_sweep(const fs::path& config, const Schema& schema, const Texts& words, const Texts& fixed,
                      const std::string& name, const SweepTask& task) {
  const Plan plan = plan_of(config, schema, words, fixed);
  Texts names;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    names.push_back(plan.runs[i].folder.filename());
    if (names.back() != name) continue;
    task.run(plan.configs[i]);
    return plan.runs[i].folder;
  }
  throw usage_error("the sweep has no run of this name; has its config changed since it was listed?", "--only", name,
                    "one of --list, such as " + nearest_word(name, names));
}

fs::path run_sweep(const fs::path& config, const Schema& schema, const Texts& words, const Texts& fixed,
                   const Texts& command, const SweepTask& task) {
  Plan plan = plan_of(config, schema, words, fixed);
  Provenance provenance = begin_provenance(command);
  run_all(task, plan);
  provenance.hashes["config"] = hash_of(plan);
  gather(provenance, plan.runs);
  if (task.record) task.record(provenance);
  provenance.ended = utc_now();
  const fs::path folder = folder_of(plan);
  make_directories(folder);
  const FileLock lock(folder / ".lock", LockKind::Write, folder);  // of two that end at once one writes all
  write_sweep(folder, plan, task, provenance);
  const std::size_t count = plan.runs.size();
  const auto elsewhere = std::ranges::count_if(plan.runs, &SweptRun::elsewhere);
  const auto failed =
      std::ranges::count_if(plan.runs, [](const SweptRun& run) { return !run.failure.empty(); }) - elsewhere;
  if (failed > 0)
    throw Error(kind_of_failures(plan.runs), fmt::format("{} of {} runs failed", failed, count), folder.string());
  if (elsewhere > 0)
    throw Error(ErrorKind::Interrupted,
                fmt::format("other processes are at work on {} of {} runs, the same command goes on from here",
                            elsewhere, count),
                folder.string());
  write_file(folder / "DONE", utc_now() + "\n");
  return folder;
}

}  // namespace clerestory
