// Weights.
#include "host/io/safetensors.hpp"

#include "tests/fuzz/target.hpp"

namespace clerestory {

static const FuzzTarget target("safetensors", "w.safetensors",
                               [](const std::filesystem::path& file) { read_finite_safetensors(file); });

}  // namespace clerestory
