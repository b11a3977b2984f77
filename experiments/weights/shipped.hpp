// Where the weights lie that come with the program.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace clerestory {

/// The folder that the environment variable names, alone; else `nets/weights` where data_places() says.
std::vector<std::filesystem::path> shipped_places(const char* variable);

/// MGNet's weights that come with the program: CLERESTORY_WEIGHTS, or maps.safetensors in one of those places. Throws
/// usage_error naming all of them when there are none.
std::filesystem::path shipped_weights();
/// Where the light's weights may lie that come with the program: what CLERESTORY_LIGHT_WEIGHTS names, or those places.
std::vector<std::filesystem::path> light_places();
/// The first of light_places() that holds them; nothing when none does.
std::optional<std::filesystem::path> shipped_light();
/// What preset lite's encoder learned on ImageNet: imagenet_lite0.safetensors in nets/weights, whatever the variable
/// says; throws likewise.
std::filesystem::path imagenet_encoder();
/// `given`, or where nothing is given the shipped ones.
std::filesystem::path weights_or_shipped(const std::filesystem::path& given);
/// The same of the light: a file, or a folder of its parts. Throws usage_error when there is no such thing, or none
/// where nothing is given.
std::filesystem::path light_or_shipped(const std::filesystem::path& given);

}  // namespace clerestory
