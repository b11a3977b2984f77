// A kernel's part of what kernel_variant.hpp tells. Private to host/cl.
#pragma once
#include "host/cl/kernel_variant.hpp"

namespace clerestory {

struct LaunchMark {
  KernelVariant variant;
  Precision precision = Precision::Single;
  long seen = -1;  // the round of forget_launched() in which it was launched last; -1: never

  /// At each launch: costs a comparison but for the first of a round.
  void launched();
};

}  // namespace clerestory
