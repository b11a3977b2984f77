#include "host/io/data_files.hpp"

#include <cstdlib>

namespace clerestory {
namespace fs = std::filesystem;

std::vector<fs::path> data_places(const fs::path& below) {
  if (const char* data = std::getenv("CLERESTORY_DATA")) return {data / below};
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  std::vector<fs::path> places;
  for (const fs::path& root :
       {folder.parent_path() / "share/clerestory", folder, folder.parent_path(), folder.parent_path().parent_path()})
    places.push_back(root / below);
  return places;
}

fs::path found_data(const fs::path& path) {
  if (fs::exists(path) || path.is_absolute()) return path;
  for (const fs::path& place : data_places(path))
    if (fs::exists(place)) return place;
  return path;
}

std::string text_of(const std::vector<fs::path>& places) {
  std::string text;
  for (const fs::path& place : places) text += (text.empty() ? "" : ", ") + place.string();
  return text;
}

}  // namespace clerestory
