// Which nets answer for a learned light, as every command finds them.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "nets/scene_light.hpp"

namespace clerestory {

/// Folder of the light's weights that come with the program: CLERESTORY_LIGHT_WEIGHTS, or `nets/weights` in the source
/// tree it was built from; nothing when they are not there.
std::optional<std::filesystem::path> shipped_light();

/// Sets settings.nets if settings.light is learned. `weights`: folder or file of load_light(), empty: the shipped ones.
/// Throws usage_error when there are none, or what load_light() throws.
void load_light_nets(RenderSettings& settings, const std::filesystem::path& weights, Device device);

/// "image", or the name of a learned light and its weights: for provenance and report.
std::string answerer_text(const RenderSettings& settings);

/// Lights for --light, the default first: learned light when it is shipped, else `image`.
std::vector<std::string> lights_to_choose();
/// For --help: which light is the default, and why.
std::string lights_note();

}  // namespace clerestory
