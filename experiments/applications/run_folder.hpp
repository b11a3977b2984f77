// A RUN folder of `clerestory invert`: what it holds and how it is read back by insert, report and evaluate.
//   albedo.exr normal.exr depth.exr material.exr rerender.exr stderr.exr uncertainty.exr camera.json provenance.json
//   render.json (how it was rendered), report.html, PNG previews, and photo.exr: the photograph in linear radiance, so
//   that the folder stands alone.
#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "host/io/image.hpp"
#include "host/report/file_lock.hpp"
#include "host/report/new_folders.hpp"
#include "host/report/provenance.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// What the Monte Carlo layer gave. Absent when only some maps were asked for (`--only`).
struct Rerender {
  Image radiance;        // 3
  Image standard_error;  // 3
  Image uncertainty;     // 1: mean u of the pixel's rays
};

/// Writes the maps of `scene` that are not empty, the re-render, camera.json and PNG previews into `folder`.
void write_run(const std::filesystem::path& folder, const Scene& scene, const std::optional<Rerender>& rerender);

/// Reads a whole scene back. Throws usage_error naming the missing file: a folder made with `--only` cannot be used.
Scene read_run(const std::filesystem::path& folder);
/// The same without that demand: maps that the folder lacks stay empty.
Scene read_run_maps(const std::filesystem::path& folder);
Rerender read_rerender(const std::filesystem::path& folder);

/// Facts of a run on which all rests that is made from it. "scale of depth" says where metres come from; a run of given
/// maps has none.
inline constexpr const char* kDepthScaleFact = "scale of depth";
inline constexpr const char* kPredictedScale = "predicted";  // a word of it where nobody measured
/// Copies those facts from a run to what is made from it; a folder without provenance.json has none.
void inherit_facts(const std::filesystem::path& run, Provenance& record);

/// Throws usage_error when there is no such folder, or another process works on it.
FolderLock lock_run(const std::filesystem::path& run, LockKind kind);

/// Throws usage_error when `json`, which the caller writes afterwards, is one of the results. It may be empty.
void keep_json_apart(const std::filesystem::path& json, const std::vector<std::filesystem::path>& results);

/// Files made from a run that lie in it or anywhere: results, and the provenance that lists them. They appear together.
class ResultFiles {
 public:
  /// Locks the run and the folder of `record`, where `results` lie too, and makes the latter. Throws usage_error before
  /// any work: when a file cannot be written, or exists and is listed neither by an earlier record nor by one of
  /// `others` (`force` gives it up), or when another process is at work.
  ResultFiles(const std::filesystem::path& run, const std::filesystem::path& record,
              const std::vector<std::filesystem::path>& results, bool force,
              const std::vector<std::filesystem::path>& others = {});
  /// Nothing stays of what was made for results that never came.
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Where to write a result for now: a folder beside it.
  std::filesystem::path staged(const std::filesystem::path& result) const { return staging_ / result.filename(); }
  /// All results are written: moves them to their places, lists them in `provenance` and writes that.
  void commit(Provenance& provenance) const;

 private:
  std::filesystem::path folder_, record_, staging_;
  std::vector<std::filesystem::path> results_;
  std::optional<NewFolders> made_;
  std::vector<FolderLock> locks_;
  std::optional<FileLock> lock_;  // of these results, wherever they lie
};

}  // namespace clerestory
