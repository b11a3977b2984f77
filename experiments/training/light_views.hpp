// Views with the light that falls into them, as the light's nets see them: maps, camera, environment maps, probes.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "experiments/evaluation/metrics.hpp"
#include "experiments/training/view_store.hpp"
#include "host/io/light_files.hpp"

namespace clerestory {

/// All radiance has one unit: the picture's 95th percentile of luminance is 0.9, nothing is clamped.
struct LightView {
  Image image, albedo, normal, depth,
      material;                   // 3, 3, 3, 1 (metres, 0 none), 3 channels (roughness, metallic, emission flag)
  Image true_normal, true_depth;  // the same where maps are true; tiles of the environment follow them
  Image emission;                 // 1 channel: 1 where the pixel emits
  Camera camera;
  Envmaps envmaps;
  std::vector<Probe> probes;
};

/// Reads a view. Throws usage_error naming the file: what read_view, read_envmaps and read_probes throw, a size that is
/// not width x height, a view without camera or without any depth.
LightView read_light_view(const ViewName& name, int width, int height);

/// What MGNet says of a picture, in place of the true maps; its depth times `metres`.
void see_predicted(LightView& view, const MapSet& maps, double metres);
/// The factor that brings the median ratio of a predicted depth to the true one to 1.
double metres_of(const LightView& view, const Image& depth);
/// What a predicted depth is measured in: metres of the truth, where nets learn, whose free probes lie in these; or
/// those that were predicted, as in use: views that judge must not know the truth.
enum class DepthUnit { True, Predicted };

/// Reads on demand and keeps up to `cache_bytes`. A view's values do not depend on whether it was kept.
/// Safe to use from several threads.
class LightStore {
 public:
  LightStore(std::vector<ViewName> names, int width, int height, std::uint64_t cache_bytes);

  std::size_t size() const { return names_.size(); }
  const ViewName& name(std::size_t i) const { return names_[i]; }
  const std::vector<ViewName>& names() const { return names_; }
  int width() const { return width_; }
  int height() const { return height_; }
  std::shared_ptr<const LightView> get(std::size_t i);
  /// From now on views come with the maps that `predict` says of their pictures, depth in predicted metres; all are
  /// predicted at once.
  void predict(const std::function<MapSet(const Image& picture)>& predict, DepthUnit unit);

 private:
  std::vector<ViewName> names_;
  int width_, height_;
  std::uint64_t cache_bytes_, used_ = 0;
  std::vector<std::shared_ptr<const LightView>> cache_;  // empty: not kept
  std::vector<MapSet> predicted_;                        // none: maps are true
  DepthUnit unit_ = DepthUnit::True;                     // of theirs
  std::mutex mutex_;
};

}  // namespace clerestory
