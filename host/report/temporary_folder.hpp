// A folder of one's own, gone with its owner.
#pragma once
#include <filesystem>

namespace clerestory {

class TemporaryFolder {
 public:
  /// Throws ErrorKind::Failed naming where none can be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace clerestory
