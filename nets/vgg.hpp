// VGG16 (Simonyan and Zisserman 2015) up to relu3_3: frozen features of the perceptual loss, with ImageNet's weights or
// with random ones.
#pragma once
#include "nets/builder.hpp"

namespace clerestory {

/// {n, 3, h, w} -> {n, 256, h/4, w/4} of imagenet_normalised() maps. States "<scope>.features.K.weight" and "bias" as
/// torchvision names them, not trainable: until they are set from a file, random (conv_shift_layer).
Value vgg_features(const Scope& scope, Value image);

}  // namespace clerestory
