// A scene on a device, and what can be asked of it: maps of a view, its picture, radiance along any rays.
#pragma once
#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <span>
#include <vector>

#include "host/cl/device.hpp"
#include "host/io/image.hpp"
#include "host/math/camera.hpp"
#include "tracer/bvh.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// Scatterings after which a path ends even when Russian roulette would let it live: at an albedo of 0.78 less than
/// 4e-4 of the light is beyond.
inline constexpr int kMaxDepth = 32;

/// Points on lights that a path tries where it first lands. 0: light is found by the surface's directions only (tests);
/// at most 15.
inline constexpr int kLightSamples = 2;

/// Rays start this far off a surface (metres); queries at points on a surface ignore what is nearer.
inline constexpr float kRayOffset = 1e-4f;

/// What a camera sees through its pixel centres. Depth: axial, metres, 0 where nothing is. Normal: unit, camera space,
/// the one that shading uses. Emission: radiance sent to the camera, unscaled.
struct TraceMaps {
  Image depth, normal, albedo, roughness, metallic, emission;
  std::vector<int> emitter, triangle;  // -1: none
};

/// Samples that were NaN or Inf: left out of the mean, and the first of them, to be replayed by its key.
struct DroppedSamples {
  long count = 0;
  int pixel = -1, sample = -1;
};

struct TracePicture {
  Image mean;      // radiance, 3 channels
  Image variance;  // of the mean, 3 channels: sample variance / samples
  DroppedSamples dropped;
};

/// Options of a radiance query.
struct RadianceQuery {
  int spp = 1;
  std::uint32_t seed = 0;
  bool emitters = true;  // false: what the ray itself hits counts with reflected light only
  int max_depth = kMaxDepth, light_samples = 1;
  /// Of what reaches the point where a ray lands by way of other surfaces: as in picture().
  float most_indirect = std::numeric_limits<float>::infinity();
  /// Angle over which textures are averaged where a ray lands, radians; 0: at its very point. Pictures take a pixel's.
  float spread = 0;
  std::array<double, 16> to_world{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};  // row-major, rigid; of the rays
};

struct TraceHit {
  float t = 0, u = 0, v = 0;
  int triangle = -1;
};

class TraceScene {
 public:
  /// Builds the hierarchy and copies everything to the device. Throws Error on an empty scene, an index out of range, a
  /// corner that is not finite, or a pane without a panorama. Double: the twin that tests compare with, of the same
  /// random numbers; what it gives is narrowed to float at the end.
  TraceScene(const Device& device, const World& scene, Precision precision = Precision::Single);
  TraceScene(const Device& device, const World& scene, Precision precision, const BvhForm& form);

  TraceMaps maps(const Camera& camera);
  /// Path-traced picture with `spp` samples per pixel, all through the pixel's centre. Same seed, same bits.
  /// most_indirect: most radiance that one contribution of a path by way of other surfaces may add; what is finite
  /// trades the specks of rare bright paths for a picture that is a little too dark.
  TracePicture picture(const Camera& camera, int spp, std::uint32_t seed, int max_depth = kMaxDepth,
                       int light_samples = kLightSamples, float most_indirect = std::numeric_limits<float>::infinity());

  /// Mean radiance that arrives at points[i] from directions[i] (pointing away from the point, any length).
  /// All three buffers hold reals of the scene's precision, planar {3, stride}; `count` <= stride rays are traced. Ray
  /// i's random numbers are keyed by (seed, i, sample). Nothing is read back; `dropped` asks for a wait and a count of
  /// samples that were not finite.
  void radiance(const Buffer& points, const Buffer& directions, const Buffer& out, int count, int stride,
                const RadianceQuery& query, DroppedSamples* dropped = nullptr);
  /// The same for host data, planar {3, count}.
  std::vector<float> radiance(const std::vector<float>& points, const std::vector<float>& directions,
                              const RadianceQuery& query, DroppedSamples* dropped = nullptr);

  /// Nearest hits of world-space rays, planar {3, count}; t in units of the direction's length.
  std::vector<TraceHit> hits(const std::vector<float>& points, const std::vector<float>& directions, float t_min,
                             float t_max);

  std::size_t triangles() const { return triangle_count_; }

 private:
  /// Arguments of a kernel that begins with SCENE_ARGUMENTS. An Arg holds a buffer's handle only: keep the buffer.
  std::vector<Arg> arguments(std::initializer_list<Arg> own) const;
  Buffer upload(std::span<const float> reals);
  Buffer upload(std::span<const std::int32_t> numbers);
  Buffer allocate(std::size_t reals);
  std::vector<float> download(const Buffer& buffer, std::size_t reals);
  Kernel kernel(const char* name);

  mutable Device device_;
  Precision precision_;
  BvhForm form_;
  std::size_t triangle_count_ = 0;
  Buffer planes_, children_, corners_, triangles_, surfaces_, materials_, emitters_, lights_, light_cdf_, panorama_,
      sky_;
  int light_count_ = 0, panorama_width_ = 0, panorama_height_ = 0;
  float panorama_turn_ = 0, sky_share_ = 0;
  int pane_leaf_ = 0, pane_leaves_ = 0;
  Buffer samples_;  // scratch of radiance()
};

}  // namespace clerestory
