// A folder of results that appears whole or not at all, and costs nobody their files.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/report/file_lock.hpp"
#include "host/report/new_folders.hpp"

namespace clerestory {

/// What a StagedFolder may cost.
struct Replacing {
  std::vector<std::filesystem::path> inputs;  // files and folders that the results are made from; empty paths are none
  bool force = false;                         // give up what the old folder holds besides its own files
};

/// Written beside its final place and moved there at the end. Until commit() the target is untouched; without commit()
/// nothing is left. A target that exists is replaced only if it is empty or a folder of results (provenance.json:
/// `--out ~` must not cost anyone their home) that holds no file of others (own_files.hpp), unless `force` gives those
/// up; never when an input lies inside. Keeps other processes out.
class StagedFolder {
 public:
  /// Throws ErrorKind::Usage naming what stands in the way.
  explicit StagedFolder(const std::filesystem::path& target, Replacing replacing = {});
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  /// Where to write for now.
  const std::filesystem::path& path() const { return staging_; }
  std::filesystem::path operator/(const std::string& name) const { return staging_ / name; }
  const std::filesystem::path& target() const { return target_; }
  void commit();

 private:
  void check_inputs() const;
  void check_target();
  std::filesystem::path target_, staging_;
  Replacing replacing_;
  std::vector<std::string> given_up_;  // what was said to go
  std::optional<NewFolders> above_;
  std::optional<FolderLock> lock_;
  bool committed_ = false;
};

}  // namespace clerestory
