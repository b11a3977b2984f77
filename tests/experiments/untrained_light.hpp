// Small nets of the light with random states, as a folder of weights: what they say is not to be judged.
#pragma once
#include <filesystem>

namespace clerestory {

void write_untrained_light(const std::filesystem::path& folder);

}  // namespace clerestory
