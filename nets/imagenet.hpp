// Pictures as nets that have learned on ImageNet expect them (torchvision's: DenseNet121, ResNet34, VGG16).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// From linear radiance {n, 3, h, w}, 0 to 1 or brighter, to a picture as screens are sent it, near enough: gamma 2.2
/// above a thousandth of white.
Value display_coded(Value radiance);

/// Less ImageNet's mean and over its deviation, by channel (0.485, 0.456, 0.406; 0.229, 0.224, 0.225). Convolutions pad
/// what comes out with zeros, which is the mean's colour: to fold this into the first convolution would be wrong there.
Value imagenet_normalised(Value picture);

/// Both: what an encoder of weights from elsewhere reads.
inline Value imagenet_input(Value radiance) { return imagenet_normalised(display_coded(radiance)); }

}  // namespace clerestory
