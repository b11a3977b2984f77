// Folders of results. RunDirectory: a run that can be interrupted, resumed, skipped when done. StagedFolder: a folder
// that appears whole or not at all. Both keep a second process out.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "host/io/config.hpp"
#include "host/report/provenance.hpp"

namespace clerestory {

/// An exclusive lock that ends with the process, however it ends. Throws ErrorKind::Usage when another one holds it.
class FileLock {
 public:
  explicit FileLock(const std::filesystem::path& path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int file_ = -1;
  std::filesystem::path path_;
};

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

  void finish() const;                          // DONE
  void fail(const std::string& message) const;  // FAILED, with the message

 private:
  std::filesystem::path path_;
  std::optional<FileLock> lock_;
};

/// A folder written beside its final place and moved there at the end. Until commit() the target is untouched; without
/// commit() nothing is left. An existing target is replaced only if it is empty or holds `marker`, the file by which
/// such folders are known: `--out ~` must not cost anyone their home.
class StagedFolder {
 public:
  explicit StagedFolder(std::filesystem::path target, std::string marker = "provenance.json");
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /// Where to write for now.
  const std::filesystem::path& path() const { return staging_; }
  std::filesystem::path operator/(const std::string& name) const { return staging_ / name; }
  const std::filesystem::path& target() const { return target_; }
  void commit();

 private:
  void check_target() const;
  std::filesystem::path target_, staging_;
  std::string marker_;
  std::optional<FileLock> lock_;
  bool committed_ = false;
};

}  // namespace clerestory
