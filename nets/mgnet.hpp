// MGNet (Zhu et al. 2022, section 4.1): one DenseNet121 encoder, four decoders; beyond the paper one decoder for all
// maps, and EfficientNet-Lite as the encoder.
#pragma once
#include <span>
#include <string>
#include <variant>

#include "nets/decoder.hpp"
#include "nets/densenet.hpp"
#include "nets/efficientnet.hpp"

namespace clerestory {

struct MgnetSize {
  std::variant<DensenetSize, EfficientnetSize> encoder;
  std::variant<DecoderSize, SharedDecoderSize> decoder;

  bool shared() const { return std::holds_alternative<SharedDecoderSize>(decoder); }
  /// Whether the encoder is one that weights learned on ImageNet come with the program for.
  bool lite() const { return std::holds_alternative<EfficientnetSize>(encoder); }
  std::span<int> steps();  // channels of the decoder's steps
  std::span<const int> steps() const;
  /// What the channels of a decoder's steps have to be multiples of, in words; empty where they are.
  std::string steps_wanted() const;
};
/// "paper", "compact", "shared" or "lite"; throws usage_error otherwise.
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

/// `image`: linear radiance, 95th percentile of luminance 0.9, clamped to [0, 1]; the shared form reads its logarithm
/// beside it, in which shadows differ as much as lit places do. The scale of the scene is one linear
/// layer on the detached mean of the encoder's last feature, beyond the paper.
Maps mgnet(Graph& graph, Value image, const MgnetSize& size, bool training);

}  // namespace clerestory
