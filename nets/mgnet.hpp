// MGNet (Zhu et al. 2022, section 4.1): one DenseNet121 encoder, four decoders.
#pragma once
#include <string>

#include "nets/decoder.hpp"
#include "nets/densenet.hpp"

namespace clerestory {

struct MgnetSize {
  DensenetSize encoder;
  DecoderSize decoder;
};
/// "paper" or "compact"; throws usage_error otherwise.
MgnetSize mgnet_size(const std::string& preset);

/// Predictions for {n, 3, h, w}. Albedo, roughness, metallic and depth in [0, 1], depth relative; normals unit, camera
/// space; log_scale: log of the scene's scale in metres (99th percentile of depth).
struct Maps {
  Value albedo;     // {n, 3, h, w}
  Value material;   // {n, 2, h, w}: roughness, metallic
  Value normal;     // {n, 3, h, w}
  Value depth;      // {n, 1, h, w}
  Value log_scale;  // {n, 1, 1, 1}
};

/// `image`: linear radiance, 95th percentile of luminance 0.9, clamped to [0, 1]. The scale of the scene is one linear
/// layer on the detached mean of the encoder's last feature, beyond the paper.
Maps mgnet(Graph& graph, Value image, const MgnetSize& size, bool training);

}  // namespace clerestory
