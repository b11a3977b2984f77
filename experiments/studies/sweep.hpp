// `-m`: one config, many values. The Cartesian product of what the overrides list, one run directory each, and tables
// over all of them.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host/io/config.hpp"
#include "host/report/plot.hpp"
#include "host/report/provenance.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// What --help says about -m.
inline constexpr const char* sweep_words =
    "Overrides may list values, as in train.rate=1e-3,5e-4 run.seed=range(0,3): a run for each combination, one after "
    "another, and tables over all of them, with mean and spread over keys named seed";

/// The tables of one run, by name.
using RunTables = std::map<std::string, Table>;

struct SweptRun;
/// Runs of a sweep that differ in seeds alone.
struct SweptPoint {
  std::vector<std::string> values;  // of the swept keys, without seeds
  std::vector<const SweptRun*> runs;
};

struct SweepTask {
  std::function<void(const Config&)> run;  // into the config's run directory; skips a finished one, goes on with a part
  std::function<RunTables(const std::filesystem::path&)> results;  // of a finished run directory
  /// Last touch to each of sweep_tables(), of which the first `named` columns say what was swept. May be empty.
  std::function<Table(const Table&, std::size_t named)> finish = {};
  /// What the sweep rests on that its runs do not say: rooms they are judged on, seeds. May be empty.
  std::function<void(Provenance&)> record = {};
  /// Tables over all runs that need more of them than their tables; `keys` are the swept ones without seeds. May be
  /// empty.
  std::function<RunTables(const std::vector<std::string>& keys, const std::vector<SweptPoint>& points)> further = {};
  /// Of the sweep's tables, before that last touch, of which the first `named` columns say what was swept. May be
  /// empty.
  std::function<std::vector<Plot>(const RunTables& tables, std::size_t named)> plots = {};
};

/// One run of a sweep.
struct SweptRun {
  std::vector<std::string> values;  // of the swept keys
  std::filesystem::path folder;
  std::string failure;  // empty: it is done
  RunTables tables;
  bool elsewhere = false;                   // it is not failed: another process is at work on it
  ErrorKind failed_by = ErrorKind::Failed;  // what kind of failure
};

/// Tables over all runs: those of one name below each other, the swept values in front. Runs that differ only in keys
/// named `seed` are one: mean and standard deviation of their means (a single run keeps its own). Text cells tell rows
/// apart. Where runs failed, or several were put together, a column says how many of how many there are. Throws Error
/// when tables of one name have other columns.
RunTables sweep_tables(const std::vector<std::string>& keys, const std::vector<SweptRun>& runs);

/// Identity of such a sweep, eight hexadecimal digits: of the configs of all its runs.
std::string sweep_hash(const std::filesystem::path& config, const Schema& schema, const std::vector<std::string>& words,
                       const std::vector<std::string>& fixed);

/// Names of the run directories of such a sweep, in their order: no two are alike.
std::vector<std::string> sweep_names(const std::filesystem::path& config, const Schema& schema,
                                     const std::vector<std::string>& words, const std::vector<std::string>& fixed);

/// For each of these names the command that makes that run, quoted for a shell, a line each: `command`, which asks for
/// the sweep, with --only in the place of --list.
std::string sweep_commands(const std::vector<std::string>& names, const std::vector<std::string>& command);

/// The run of that name alone, without tables over all. Returns its directory. Throws what its run throws, and
/// usage_error when the sweep has no such run.
std::filesystem::path run_of_sweep(const std::filesystem::path& config, const Schema& schema,
                                   const std::vector<std::string>& words, const std::vector<std::string>& fixed,
                                   const std::string& name, const SweepTask& task);

/// Runs the config for each of its variants and each element of expand_sweep(words); `fixed` overrides come after.
/// All configs are checked before the first run. A run that fails lets the others go on; one on which another process
/// is at work is left to it, and looked at again in the end. Prints the tables, and writes them with report.html and
/// provenance.json to <root>/<experiment>/sweep-<hash>, DONE too when all runs are done. Returns that folder. Throws
/// Error (Failed) at the end when a run failed, Interrupted when asked to stop or while others are at work: the same
/// command goes on. Throws usage_error when two runs would share a directory.
std::filesystem::path run_sweep(const std::filesystem::path& config, const Schema& schema,
                                const std::vector<std::string>& words, const std::vector<std::string>& fixed,
                                const std::vector<std::string>& command, const SweepTask& task);

}  // namespace clerestory
