// Which nets answer for a learned light, as every command finds them.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/report/provenance.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {

/// Folder of the light's weights that come with the program: CLERESTORY_LIGHT_WEIGHTS, or the first of shipped_places()
/// that holds them; nothing when none does.
std::optional<std::filesystem::path> shipped_light();

/// How a learned light is had; other lights are as they are.
struct LightChoice {
  std::filesystem::path weights;  // folder or file; empty: the shipped ones
  std::string lamps = "fit";      // fit | none: soft lamps fitted to the photograph's shading (nets/soft_lamps.hpp)
  std::string why = "";           // who answers is not who was hoped for: said and recorded beside the answer
};

/// Sets settings.light from the command line: `light`, if it was `asked` for; else what a default is: net where
/// --light-weights names weights, else `light`.
void choose_light(RenderSettings& settings, LightChoice& choice, const std::string& light, bool asked);

/// The sampler where none was asked for: the photograph as light has its lamps in view, and directions go there too.
void choose_sampler(RenderSettings& settings);

/// Sets settings.nets and settings.lamps if settings.light is learned, and records and says what answers. `scene` is
/// the photograph's, before any change. Throws what load_light_nets() throws.
void take_light(RenderSettings& settings, const LightChoice& choice, Device& device, const Scene& scene,
                Provenance& record);

/// Where a learned light's weights are: `weights`, if empty the shipped ones; nothing for other lights. Throws
/// usage_error when there are none.
std::filesystem::path find_light_weights(const RenderSettings& settings, const std::filesystem::path& weights);

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
