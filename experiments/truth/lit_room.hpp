// Generated rooms whose light is known along single rays: from the surfaces that a view shows, and in free air.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/evaluation/light_errors.hpp"
#include "experiments/training/light_batches.hpp"
#include "experiments/truth/room_list.hpp"
#include "host/io/config.hpp"
#include "nets/scene.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Share of a view's points that are free probes, as in training.
inline constexpr double kProbeRows = 0.2;

/// Keys of `data`, `incident` and study.seeds (experiments/studies/study_keys.hpp).
struct LitRoomOptions {
  int width = 160, height = 120, views = 3;
  int spp = 48;      // of the picture
  double clamp = 1;  // most that one indirect contribution adds, in units of the picture's white; 0: no bound
  int seeds = 3;     // draws of rays
  int rows = 256, samples = 16, ray_spp = 64;
  int probes = 2, probe_spp = 64;  // of each of a probe's two estimates
  bool predicted = false, clipped = false;
  std::filesystem::path maps_weights;  // empty: the shipped ones
};
LitRoomOptions lit_room_options(const Config& config);

/// A view and rays with their light; all radiance in the unit of its picture (95th percentile of luminance 0.9).
struct KnownView {
  LightView view;                // as nets and photograph see it; probes hold the mean of two estimates
  std::vector<Image> noise;      // of each probe: variance of that mean, from how the two differ
  std::vector<LightRays> draws;  // of each seed, `rows` points and `samples` rays from each
  std::string note;              // which weights predicted the maps; empty: maps are true
};

/// One room on the device. Everything is a function of its seed and the options.
class LitRoom {
 public:
  LitRoom(const Device& device, const ListedRoom& listed, const LitRoomOptions& options);
  /// Draws are those of draw_rays(): tiles of the environment maps, and probes. The truth of a ray from a surface
  /// leaves the true surface of its pixel, also where the maps are predicted.
  KnownView view(int v);
  /// What rays of that view meet first, in its camera's metres; not finite where they meet nothing.
  std::vector<Vec3> first_surfaces(const KnownView& known, const LightRays& rays);

 private:
  float most_indirect(const Camera& camera, const Random& random);
  void add_probes(KnownView& known, const TraceMaps& maps, const RadianceQuery& query, float exposure, Random random);
  void trace_draw(const LightView& view, LightRays& rays, const RadianceQuery& query, float exposure);

  Device device_;
  LitRoomOptions options_;
  std::uint64_t seed_;
  Room room_;
  TraceScene traced_;
  std::vector<Camera> cameras_;
};

/// Where rays of a draw start in the true room: on the true surface of the pixel that they skip, drawn back and lifted
/// by kRayOffset as the tracer's own paths are; probes' as they are. Camera metres.
Vec3 true_start(const LightView& view, const LightRays& rays, std::size_t i);

/// The view as the light's applications see it.
Scene scene_of(const LightView& view);

/// Solid angles of a probe's texels, row by row.
std::vector<double> probe_weights();

}  // namespace clerestory
