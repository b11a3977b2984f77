// Where the weights lie that come with the program.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// The folder that the environment variable names, alone; else `nets/weights` beside the program, above it (as in the
/// source tree, build/clerestory), and in the source tree that it was built from, wherever the program is now.
std::vector<std::filesystem::path> shipped_places(const char* variable);

/// MGNet's weights that come with the program: CLERESTORY_WEIGHTS, or maps.safetensors in one of those places. Throws
/// usage_error naming all of them when there are none.
std::filesystem::path shipped_weights();
/// What preset lite's encoder learned on ImageNet: imagenet_lite0.safetensors in one of those places; throws likewise.
std::filesystem::path imagenet_encoder();
/// `given`, or where nothing is given the shipped ones.
std::filesystem::path weights_or_shipped(const std::filesystem::path& given);

/// For messages.
std::string text_of(const std::vector<std::filesystem::path>& places);

}  // namespace clerestory
