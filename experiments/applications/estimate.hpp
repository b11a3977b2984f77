// What `clerestory invert` is going to cost, before it starts.
#pragma once
#include <string>

#include "experiments/applications/predict.hpp"
#include "host/cl/device.hpp"
#include "nets/mgnet.hpp"
#include "nets/mixed_light.hpp"

namespace clerestory {

/// Floating-point operations of matrix products and convolutions, a multiply-add counted as two. The light's are what
/// rays cost at most: every ray asks both parts.
struct InvertWork {
  double maps = 0;      // MGNet, heads that are asked for
  double encoders = 0;  // of the light
  double in_view = 0, out_of_view = 0;
  double all() const { return maps + encoders + in_view + out_of_view; }
};

/// The light that rays ask.
struct AskedLight {
  std::string name;  // of --light
  LightSizes net;    // where it is learned
  double rays = 0;
};

/// Maps' net of a preset at its own size (longer side 320 for paper, 160 for compact) on a picture of width x height,
/// and the light's.
InvertWork invert_work(Device& device, const std::string& preset, int width, int height, const PredictRequest& request,
                       const AskedLight& light);

/// "maps 12.0 GFLOP, light 3.0 GFLOP once and at most 116.0 TFLOP for rays (...): 580 s at the measured peak of 200
/// GFLOP/s, which no kernel reaches".
std::string describe(const InvertWork& work, double peak_gflops);

}  // namespace clerestory
