// Albedo without a net: colour Retinex (Land & McCann 1971, as Grosse et al. 2009 formulate it). A simple rival of
// learned albedo, which reads the picture alone.
#pragma once
#include "host/io/image.hpp"

namespace clerestory {

/// Between neighbours a change of albedo is one of more than this; else it is one of light.
struct RetinexThresholds {
  double intensity = 0.4;  // of the mean logarithm of the channels
  double chroma = 0.2;     // of what is left of the logarithms, as a length
};

/// Albedo up to one scale, brightest 1, from a linear picture, which is clamped to [1/255, 1]. Its chromaticity is the
/// picture's: light is taken to be white.
Image retinex_albedo(const Image& picture, const RetinexThresholds& thresholds = {});

}  // namespace clerestory
