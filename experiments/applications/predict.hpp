// MGNet on one photograph: from linear radiance of any size to maps of the same size.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/weights/map_predictor.hpp"
#include "host/cl/device.hpp"
#include "host/io/image.hpp"
#include "host/ops/tensor/joint_bilateral.hpp"

namespace clerestory {

struct PredictRequest : WantedMaps {
  std::string preset;  // that the weights must have; empty: any
};

struct Prediction {
  Image albedo, normal;     // 3, 3
  Image depth;              // 1: relative, 0..1
  Image material;           // 3: roughness, metallic, 0
  double scene_scale = 0;   // metres of the 99th percentile of depth
  std::string off_by;       // how far scene_scale is typically off: on generated rooms, on real photographs
  std::string note;         // weights, preset and size the network ran at
  std::string explanation;  // of the plans
  std::vector<std::string> left_out;
};

/// The photograph enters scaled so that its 95th percentile of luminance is 0.9 and clamped to [0, 1], resized to the
/// longer side stored with the weights, once as it is and once mirrored; maps come back to full size by a joint
/// bilateral guided by the photograph. Throws usage_error naming the weights when they do not fit.
Prediction predict_maps(Device& device, const std::filesystem::path& weights, const Image& photo,
                        const PredictRequest& request, Precision precision = Precision::Single);

/// How normals come back: where two surfaces meet a normal is one's or the other's. Other maps are averaged.
inline constexpr JointBilateral enlarges_normals{.alike = 0.3};

/// A small map at the size of the photograph, as those of MGNet are brought there. `small`: the photograph at the map's
/// size; both exposed alike. Where `mask` (1 channel, of the map's size) is 0 the map says nothing.
Image enlarged(Device& device, const Image& map, const Image& mask, const Image& small, const Image& photo,
               const JointBilateral& by = {});

}  // namespace clerestory
