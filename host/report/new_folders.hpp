// Folders made for results that may never come.
#pragma once
#include <filesystem>
#include <vector>

namespace clerestory {

/// Makes a folder and those above it. Of the ones that were not there, those that are empty go again in the end.
class NewFolders {
 public:
  /// Throws ErrorKind::Usage naming the folder that cannot be made.
  explicit NewFolders(const std::filesystem::path& folder);
  ~NewFolders();
  NewFolders(const NewFolders&) = delete;
  NewFolders& operator=(const NewFolders&) = delete;

 private:
  std::vector<std::filesystem::path> made_;  // the innermost first
};

}  // namespace clerestory
