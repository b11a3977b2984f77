// A run that can be interrupted, resumed, skipped when done, and that keeps a second process out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "host/io/config.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/new_folders.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {

struct Checkpoint {
  std::int64_t step = 0;
  std::filesystem::path path;
};

///   runs/<experiment>/<variant>-<config hash>-s<seed>/
///     config.resolved.toml provenance.json metrics.jsonl log.txt checkpoints/ artifacts/ report.html DONE | FAILED
class RunDirectory {
 public:
  /// Opens or creates the directory of this run and locks it. A directory that holds another config throws. `restart`
  /// throws away what an earlier run left.
  RunDirectory(const std::filesystem::path& root, const std::string& experiment, const std::string& variant,
               const Config& config, std::uint64_t seed, bool restart = false);

  /// Where a run lies, made or not. Throws ErrorKind::Usage for a name that is not fit for a folder.
  static std::filesystem::path path_of(const std::filesystem::path& root, const std::string& experiment,
                                       const std::string& variant, const Config& config, std::uint64_t seed);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  /// The lock of the directory at `path`, for others who work on it.
  static std::filesystem::path lock_of(const std::filesystem::path& path) { return path / ".lock"; }
  /// The run was completed before: skip it.
  bool done() const;
  /// An earlier run left a checkpoint.
  bool resumable() const { return latest_checkpoint().has_value(); }

  /// checkpoints/step-00000120.safetensors: write it under a temporary name and rename it, then it counts.
  std::filesystem::path checkpoint_path(std::int64_t step) const;
  std::optional<Checkpoint> latest_checkpoint() const;
  /// Deletes all but the `keep` newest checkpoints.
  void prune_checkpoints(int keep) const;
  std::filesystem::path artifact(const std::string& name) const { return path_ / "artifacts" / name; }
  std::filesystem::path metrics_path() const { return path_ / "metrics.jsonl"; }

  /// Cuts metrics.jsonl back to `step` (0: empty) and drops FAILED and later checkpoints: call it before going on.
  void resume_at(std::int64_t step) const;
  /// One line into log.txt with the time, and to stderr unless quiet.
  void log(const std::string& line) const;

  void finish() const;  // DONE
  /// What becomes of a run that ends by `error`. An interrupted one goes on; bad input leaves nothing of a run that was
  /// not here before and has no `results`; any other gets FAILED, with the message.
  void fail(const Error& error, bool results) const;

 private:
  std::filesystem::path path_;
  std::optional<NewFolders> made_;  // nothing but empty folders: none
  bool fresh_ = false;              // nothing was here before
  std::optional<FileLock> lock_;
};

}  // namespace clerestory
