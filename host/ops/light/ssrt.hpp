// Screen-space ray tracing (kernels/light/ssrt.cl): which pixel a ray meets, how far behind its surface, how sure.
#pragma once
#include <string>

#include "host/graph/graph.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

enum class SsrtSolver { Dda, Hierarchical };  // the same cells, to the last bit
enum class DeltaDepth { Linear, Window };

SsrtSolver ssrt_solver_of(const std::string& name);  // dda | hierarchical; throws usage_error
DeltaDepth delta_depth_of(const std::string& name);  // linear | window; throws usage_error
const char* name_of(DeltaDepth delta);

struct SsrtOptions {
  SsrtSolver solver = SsrtSolver::Hierarchical;
  DeltaDepth delta = DeltaDepth::Linear;
  double thickness = 0;  // metres behind a cell's depth at which a ray passes unseen; 0: surfaces are infinitely thick
  int lanes = 0;         // rays that a work-item takes side by side: 1, 4, 8 or 16, of the same bits; 0: ssrt_lanes()
};

/// What is fastest on this device by `clerestory bench ssrt`.
int ssrt_lanes(const Device& device);

/// Where rays start. Nothing set: on the surface of the pixel that they belong to, which they skip.
struct RayOrigins {
  Value points;            // camera metres: {1, 3, pixels, samples}, or {n, 3, h, w} where they are of_pixels
  Value skip;              // Int, one channel, same layout: pixel y * w + x that the ray does not hit, or -1
  bool of_pixels = false;  // a ray starts where its pixel of the picture says; a chunk's shape may be the picture's
};

/// What rays are traced against: maps, and what is made of them once.
struct SsrtScene {
  Value depth;                        // {n, 1, h, w}, metres, 0 = none
  Value pyramid;                      // depth_pyramid(depth)
  Value normal;                       // {n, 3, h, w}, or no value: then cells that face away from the ray are hit too
  Value boxes;                        // normal_pyramid(normal)
  std::vector<Value> values() const;  // those that there are
};
SsrtScene ssrt_scene(Value depth, Value normal = {});
/// The same in another graph, by its values() there: two, or four with normals.
SsrtScene ssrt_scene(std::span<const Value> values);

struct SsrtHits {
  Value pixel;  // Int {1, 1, pixels, samples}: y * w + x, or -1 on a miss
  Value delta;  // how far the ray is behind the surface it meets, >= 0, over scene_scale (or in window depth); 0 on a
                // miss
  Value u;      // uncertainty tanh(10 delta); 1 on a miss; 0 where the direction is (0, 0, 0)
};

/// `camera` {n, 4, 1, 1} and `range` {n, 3, 1, 1} by camera_tensor() and depth_range(); `directions` {1, 3, pixels,
/// samples} in the camera frame, any length. Contract: architecture, "SSRT"; no gradient: cells are discrete, and
/// directions detached.
SsrtHits ssrt(const SsrtScene& scene, Value camera, Value range, Value directions, const RayOrigins& origins = {},
              const SsrtOptions& options = {});

/// fx, fy, cx, cy of each picture, {n, 4, 1, 1}.
Tensor camera_tensor(std::span<const Camera> cameras);
/// scene_scale (metres), smallest and largest valid depth of each picture, {n, 3, 1, 1}. Throws usage_error when a
/// picture has no valid depth.
Tensor depth_range(const Tensor& depth);

}  // namespace clerestory
