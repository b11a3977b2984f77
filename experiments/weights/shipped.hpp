// Where the weights lie that come with the program.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// The folder that the environment variable names, alone; else `nets/weights` where data_places() says.
std::vector<std::filesystem::path> shipped_places(const char* variable);

/// MGNet's weights that come with the program: CLERESTORY_WEIGHTS, or maps.safetensors in one of those places. Throws
/// usage_error naming all of them when there are none.
std::filesystem::path shipped_weights();
/// What preset lite's encoder learned on ImageNet: imagenet_lite0.safetensors in nets/weights, whatever the variable
/// says; throws likewise.
std::filesystem::path imagenet_encoder();
/// `given`, or where nothing is given the shipped ones.
std::filesystem::path weights_or_shipped(const std::filesystem::path& given);

}  // namespace clerestory
