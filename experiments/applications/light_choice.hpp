// Which nets answer for a learned light, as every command finds them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "host/report/provenance.hpp"
#include "nets/scene_light.hpp"

namespace clerestory {

/// How a light is had.
struct LightChoice {
  std::filesystem::path weights;  // of a learned one: folder or file; empty: the shipped ones
  std::string lamps = "auto";  // fit | none: soft lamps fitted to the photograph's shading (nets/soft_lamps.hpp); auto:
                               // fit under learned light
  std::string why = "";        // who answers is not who was hoped for: said and recorded beside the answer
};

/// Sets settings.light from the command line: `light`, if it was `asked` for; else what a default is: where weights are
/// named (choice.weights) the light that they answer for, else `light`. Throws what light_or_shipped() and
/// read_light_sizes() throw.
void choose_light(RenderSettings& settings, LightChoice& choice, const std::string& light, bool asked);

/// The sampler where none was asked for: the photograph as light has its lamps in view, and directions go there too.
void choose_sampler(RenderSettings& settings);

/// Sets settings.nets if settings.light is learned, and settings.lamps if they are fitted, and records and says what
/// answers. `scene` is the photograph's, before any change. Throws what load_light_nets() throws.
void take_light(RenderSettings& settings, const LightChoice& choice, Device& device, const Scene& scene,
                Provenance& record);

/// What must be refused before the work: throws what light_or_shipped() and check_method() throw of a learned light's
/// weights, of which it reads the sizes alone.
void check_light_weights(const RenderSettings& settings, const std::filesystem::path& weights);

/// Sets settings.nets if settings.light is learned. `weights`: as light_or_shipped() takes them.
/// Throws what light_or_shipped(), load_light() and check_method() throw.
void load_light_nets(RenderSettings& settings, const std::filesystem::path& weights, Device device);

/// "image", or the name of a learned light and its weights: for provenance and report.
std::string answerer_text(const RenderSettings& settings);

/// Lights for --light, the default first: learned light when it is shipped, else `image`.
std::vector<std::string> lights_to_choose();
/// For --help: which light is the default, and why.
std::string lights_note();

}  // namespace clerestory
