// The shape of the light's nets as text, which travels in the metadata of their weights.
#pragma once
#include <map>
#include <string>

#include "nets/mixed_light.hpp"

namespace clerestory {

/// "in_view.blocks=3-4-6-3 in_view.channels=... out_of_view.jitter=true": every field of LightSizes as key=value.
std::string light_text(const LightSizes& sizes);
/// Back from light_text(). A key that the text lacks has LightSizes' default: the text is older than the field. Throws
/// usage_error naming `where` and the key for an unknown key or a value that makes no sense.
LightSizes light_from_text(const std::string& text, const std::string& where);

/// Names and shapes of the states that inference needs: what the weights' files hold.
std::map<std::string, Shape> light_states(const LightSizes& sizes);

}  // namespace clerestory
