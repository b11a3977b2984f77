// VGG16 (Simonyan and Zisserman 2015) up to relu3_3: the frozen features of the perceptual loss. They mean something
// only with ImageNet's weights; nobody builds this without a file of them.
#pragma once
#include "nets/builder.hpp"

namespace clerestory {

/// {n, 3, h, w} -> {n, 256, h/4, w/4} of imagenet_normalised() maps. States "<scope>.features.K.weight" and "bias" as
/// torchvision names them, not trainable.
Value vgg_features(const Scope& scope, Value image);

}  // namespace clerestory
