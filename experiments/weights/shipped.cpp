#include "experiments/weights/shipped.hpp"

#include <cstdlib>

#include "host/error.hpp"
#include "host/io/data_files.hpp"

namespace clerestory {
namespace fs = std::filesystem;

namespace {

constexpr const char* kWeights = "nets/weights";

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

fs::path weights_or_shipped(const fs::path& given) { return given.empty() ? shipped_weights() : given; }

}  // namespace clerestory
