// The Monte Carlo layer on one scene's geometry, compiled once: what chosen pixels reflect, of any material, under any
// picture as light.
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "host/graph/plan.hpp"
#include "host/ops/shade/render.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

class SceneLayer {
 public:
  /// `scene` must outlive the layer: its geometry is what rays meet.
  SceneLayer(Device& device, const Scene& scene, const RenderSettings& settings);

  /// Reflected radiance, 3 channels, of the pixels in `shade` (row-major), 0 elsewhere. albedo and material as a
  /// Scene's; `light`: the photograph that the light reads; `ambient`: of rays that leave it, under `light = image`.
  Image radiance(const Image& albedo, const Image& material, const Image& light, const std::array<double, 3>& ambient,
                 const std::vector<bool>& shade, std::uint32_t seed);

  const std::vector<bool>& shaded() const { return shaded_; }  // of the last render: those that face the viewer
  const RenderCounts& counts() const { return counts_; }       // of the last render
  double seconds() const { return seconds_; }                  // of all renders, after the plan was made

 private:
  Device& device_;
  const Scene& geometry_;
  Graph graph_;
  Rendered rendered_;
  std::optional<Executor> executor_;
  std::vector<bool> shaded_;
  RenderCounts counts_;
  double seconds_ = 0;
};

}  // namespace clerestory
