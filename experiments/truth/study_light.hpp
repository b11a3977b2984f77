// Lights by the names that studies give them: who answers, and what is fitted to the scene.
#pragma once
#include <string>

#include "nets/scene_light.hpp"

namespace clerestory {

/// A light as studies name it: a name of light_names(); "net" is whichever learned light the nets answer for;
/// "net+lamps", one with lamps fitted to its scene; "constant+fit", "image+fit", "panorama+fit" and
/// "mirrored+fit", a light without nets as bright as the scene's shading says (nets/constant_light.hpp). FLOOR,RIDGE
/// after either weigh the fit: "net+lamps .5,1".
struct StudyLight {
  std::string light;   // "net"
  std::string fitted;  // "lamps", "fit" or nothing
  FitWeights fit;      // what is not said: the settings' own for lamps, else kConstantFit
};
/// Throws usage_error on another name.
StudyLight study_light(const std::string& name);
/// What tables call a light so named; learned light is that of `whose` nets. Throws what study_light() and
/// is_learned_light() throw.
std::string light_label(const std::string& name, const std::string& whose);
/// Whether base.nets answer for the light so named; true of lights that are not learned.
bool nets_answer(const RenderSettings& base, const std::string& name);
/// `base` under a light so named. Throws what study_light() throws.
RenderSettings under_light(RenderSettings base, const std::string& name, Device& device, const Scene& scene);

}  // namespace clerestory
