#include "experiments/training/shipped.hpp"

#include <fmt/format.h>

#include <cstdlib>

#include "host/error.hpp"

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

fs::path shipped_weights() {
  std::vector<fs::path> files = shipped_places("CLERESTORY_WEIGHTS");
  for (fs::path& file : files) {
    if (file.extension() != ".safetensors") file /= "maps.safetensors";
    if (fs::exists(file)) return file;
  }
  throw usage_error("there are no weights; name some with --weights or CLERESTORY_WEIGHTS", text_of(files));
}

fs::path imagenet_encoder() {
  std::vector<fs::path> files = shipped_places("CLERESTORY_WEIGHTS");
  for (fs::path& file : files) {
    file = (file.extension() == ".safetensors" ? file.parent_path() : file) / "imagenet_lite0.safetensors";
    if (fs::exists(file)) return file;
  }
  throw usage_error("the encoder's weights are not there; model.encoder = \"random\" does without", text_of(files));
}

fs::path weights_or_shipped(const fs::path& given) { return given.empty() ? shipped_weights() : given; }

std::string text_of(const std::vector<fs::path>& places) {
  std::string text;
  for (const fs::path& place : places) text += (text.empty() ? "" : ", ") + place.string();
  return text;
}

}  // namespace clerestory
