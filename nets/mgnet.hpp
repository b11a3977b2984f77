// MGNet (Zhu et al. 2022, section 4.1): one DenseNet121 encoder, four decoders; beyond the paper one decoder for all
// maps, and EfficientNet-Lite as the encoder. In its place the net of maps of Li et al. 2020, the rival.
#pragma once
#include <span>
#include <string>
#include <variant>

#include "nets/decoder.hpp"
#include "nets/densenet.hpp"
#include "nets/efficientnet.hpp"
#include "nets/li2020.hpp"

namespace clerestory {

struct MgnetSize {
  std::variant<DensenetSize, EfficientnetSize, Li2020MapsSize> encoder;
  std::variant<DecoderSize, SharedDecoderSize> decoder;  // not of Li et al., whose sizes are all in `encoder`

  bool shared() const { return std::holds_alternative<SharedDecoderSize>(decoder); }
  /// Whether the encoder is one that weights learned on ImageNet come with the program for.
  bool lite() const { return std::holds_alternative<EfficientnetSize>(encoder); }
  bool li2020() const { return std::holds_alternative<Li2020MapsSize>(encoder); }
  std::span<int> steps();  // channels of the decoder's steps
  std::span<const int> steps() const;
  /// What the channels of a decoder's steps have to be multiples of, in words; empty where they are.
  std::string steps_wanted() const;
};
/// "paper", "compact", "shared" or "lite", or of Li et al. "li2020_paper" or "li2020"; throws usage_error otherwise.
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
/// layer on the detached mean of the encoder's last feature, beyond the papers. The net of Li et al. knows no metal.
Maps mgnet(Graph& graph, Value image, const MgnetSize& size, bool training);

/// Features of mgnet()'s encoder at 1/2, 1/4, 1/8, 1/16 and less of `image` {n, 3, h, w}, from 0 up. States
/// "<scope>.*" as mgnet() has them below "encoder". Not of the net of Li et al., which has no such encoder.
std::array<Value, 5> mgnet_encoder(const Scope& scope, Value image, const MgnetSize& size);

}  // namespace clerestory
