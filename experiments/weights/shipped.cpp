#include "experiments/weights/shipped.hpp"

#include <algorithm>
#include <cstdlib>

#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/io/data_files.hpp"

namespace clerestory {
namespace fs = std::filesystem;

namespace {

constexpr const char* kWeights = "nets/weights";

bool holds_light(const fs::path& folder) {
  return fs::is_directory(folder) &&
         std::ranges::all_of(weights_files(folder), [](const fs::path& file) { return fs::exists(file); });
}

/// The first of these that is there; a place that is a folder holds it by its `name`.
fs::path first_found(std::vector<fs::path> places, const char* name, const char* else_what) {
  for (fs::path& place : places) {
    if (place.extension() != ".safetensors") place /= name;
    if (fs::exists(place)) return place;
  }
  throw usage_error(else_what, text_of(places));
}

}  // namespace

std::vector<fs::path> shipped_places(const char* variable) {
  if (const char* set = std::getenv(variable)) return {set};
  return data_places(kWeights);
}

fs::path shipped_weights() {
  return first_found(shipped_places("CLERESTORY_WEIGHTS"), "maps.safetensors",
                     "there are no weights; name some with --weights or CLERESTORY_WEIGHTS");
}

fs::path imagenet_encoder() {
  return first_found(data_places(kWeights), "imagenet_lite0.safetensors",
                     "the encoder's weights are not there; model.encoder = \"random\" does without");
}

std::vector<fs::path> light_places() { return shipped_places("CLERESTORY_LIGHT_WEIGHTS"); }

std::optional<fs::path> shipped_light() {
  for (const fs::path& folder : light_places())
    if (holds_light(folder)) return folder;
  return std::nullopt;
}

fs::path weights_or_shipped(const fs::path& given) { return given.empty() ? shipped_weights() : found_data(given); }

fs::path light_or_shipped(const fs::path& asked) {
  const fs::path given = asked.empty() ? asked : found_data(asked);
  const std::string expected = "light_local.safetensors and light_global.safetensors";
  const std::optional<fs::path> shipped = given.empty() ? shipped_light() : std::nullopt;
  if (given.empty() && !shipped)
    throw usage_error("there are no weights of the light; name some with --light-weights or CLERESTORY_LIGHT_WEIGHTS",
                      text_of(light_places()), "none", expected);
  if (shipped) return *shipped;
  if (!fs::exists(given)) throw usage_error("there is no such file or folder", given.string(), {}, expected);
  if (fs::is_directory(given) && !holds_light(given))
    throw usage_error("this folder has no weights of the light", given.string(), {}, expected);
  return given;
}

}  // namespace clerestory
