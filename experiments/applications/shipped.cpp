#include "experiments/applications/shipped.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace clerestory {
namespace fs = std::filesystem;

std::vector<fs::path> shipped_places(const char* variable) {
  if (const char* set = std::getenv(variable)) return {set};
  std::vector<fs::path> places;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error)
    for (const fs::path& folder : {program.parent_path(), program.parent_path().parent_path()})
      places.push_back(folder / "nets/weights");
  const fs::path source = fs::path(CLERESTORY_SOURCE_DIR) / "nets/weights";
  if (places.empty() || places.back() != source) places.push_back(source);
  return places;
}

std::string text_of(const std::vector<fs::path>& places) {
  std::string text;
  for (const fs::path& place : places) text += (text.empty() ? "" : ", ") + place.string();
  return text;
}

}  // namespace clerestory
