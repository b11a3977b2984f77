// Tiny data sets written by tests: boxes of flat colour whose maps are known.
#pragma once
#include <filesystem>
#include <string>

namespace clerestory {

/// A folder of its own under the temporary one, removed at the end.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& name);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Writes `rooms` rooms of `views` views each, width x height, listed in <split>.txt. Every view has a wall and a floor
/// whose colours, roughness and distance are drawn from `seed`; the picture is albedo times a shade, one corner emits.
void write_synthetic_rooms(const std::filesystem::path& root, const std::string& split, int rooms, int views, int width,
                           int height, unsigned seed);

}  // namespace clerestory
