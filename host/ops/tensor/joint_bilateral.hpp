// Joint bilateral upsampling (kernels/tensor/joint_bilateral.cl): small maps follow the edges of a large picture.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// What belongs together.
struct JointBilateral {
  double sigma = 0.1;  // how much the guide may differ, in its own values (display values in [0, 1] suit eyes)
  double reach = 0.5;  // how far away, in small pixels
  double alike = 0;    // how much values may differ from the one that most agree with; 0: all are averaged
};

/// x {N, C, h, w} (or larger below and to the right: padding that is not read), guide_low {N, 3, h, w}, guide {N, 3, H,
/// W} -> {N, C, H, W}. No gradient: it serves finished maps.
Value joint_bilateral(Value x, Value guide_low, Value guide, const JointBilateral& by = {});

}  // namespace clerestory
