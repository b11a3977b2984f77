// The shape of MGNet as text, which travels in the metadata of its weights.
#pragma once
#include <map>
#include <string>

#include "host/graph/op.hpp"
#include "nets/mgnet.hpp"

namespace clerestory {

/// Names and shapes of the states that inference needs: what a weights file holds.
std::map<std::string, Shape> maps_states(const MgnetSize& net);

/// "growth 16, 32 first channels, layers 6-12-24-16, decoder 128-64-32-16-16" (before the decoder "input imagenet",
/// where it is so): identity of a net's shape, in metadata and messages, and back. Throws usage_error naming `where`.
std::string net_text(const MgnetSize& net);
MgnetSize net_from_text(const std::string& text, const std::string& where);

/// States of the frozen feature net of the perceptual loss (PerceptualFeatures::scope): never stored with ours.
inline bool is_frozen_feature(const std::string& state) {
  return state.starts_with("vgg.") || state.starts_with("rooms.");
}

}  // namespace clerestory
