// --method, --light, --light-weights and --weights, as invert, insert, edit and light take them.
#pragma once
#include <filesystem>

#include "experiments/applications/light_choice.hpp"
#include "experiments/commands/cli.hpp"

namespace clerestory {

/// Who answers for the light, into `render` and `lit_by`; returns the weights of the maps, empty for the shipped ones.
/// Throws usage_error for a method and weights beside it, and what find_method() and choose_light() throw.
std::filesystem::path take_method(const CommonOptions& common, RenderSettings& render, LightChoice& lit_by);

}  // namespace clerestory
