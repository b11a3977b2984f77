// The light of a scene asked along any rays, from any point: panoramas, probes, whatever is not the re-render.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "host/math/vec.hpp"
#include "nets/render_scene.hpp"

namespace clerestory {

/// How a surface sees rays (host/ops/light/rays.hpp): specular {3, count} planar, density {count}.
struct RayLobes {
  std::vector<float> specular, density;
};

/// Rays in camera space: where they start (metres), where they go (any length but zero, pointing away), and the pixel
/// y * w + x of the scene that a ray does not hit, or -1. Lists of one length; skip may be empty: none is skipped.
struct Rays {
  std::vector<Vec3> points, directions;
  std::vector<int> skip;
  RayLobes lobes;         // empty: no surface asks
  std::vector<int> hits;  // under RayHits::Given: the pixel that a ray surely hits, or -1
};

/// Who says where rays end: the scene's depth map, or whoever asks (an oracle).
enum class RayHits { Traced, Given };

struct RadianceAnswers {
  std::vector<float> radiance;     // {3, count} planar, the photograph's unit
  std::vector<float> uncertainty;  // u of each ray; 1 on a miss; 0 under a light that traces nothing
  std::vector<int> pixel;          // that it hits, or -1
  /// Rays that each part of a learned light answered: "in view", "out of view".
  std::vector<std::pair<std::string, double>> answered;
};

/// What does not depend on rays is computed once, at construction.
class SceneRadiance {
 public:
  /// settings: light, nets, ssrt, delta; after_chunk hears of each block of rays; `most` rays are asked at once. Throws
  /// what scene_light() throws.
  SceneRadiance(Device device, const Scene& scene, const RenderSettings& settings, std::size_t most,
                RayHits hits = RayHits::Traced);
  ~SceneRadiance();
  RadianceAnswers radiance(const Rays& rays);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clerestory
