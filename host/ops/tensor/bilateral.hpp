// Joint bilateral up-sampling (kernels/tensor/bilateral.cl): maps follow the edges of a photograph.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

struct BilateralSpec {
  double space = 1;     // deviation in pixels of the low-resolution grid
  double range = 0.1;   // deviation of the guide's values
  int valid_height = 0, valid_width = 0;  // top-left part of the map that is not padding; 0: all
};

/// x {N, C, h, w} -> {N, C, H, W}, the size of `guide` {N, G, H, W}; `small_guide` {N, G, h, w} is the guide as x saw it
/// (resize_area). Weights are positive and sum to 1: values stay within those of x. No gradient: it finishes predictions.
Value bilateral_upsample(Value x, Value small_guide, Value guide, const BilateralSpec& spec = {});

}  // namespace clerestory
