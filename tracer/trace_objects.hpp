// Inserted objects on a device: which rays hit them, and where. Rays live in device memory, in chunks.
#pragma once
#include <array>
#include <vector>

#include "host/cl/device.hpp"
#include "host/io/mesh_file.hpp"
#include "tracer/bvh.hpp"

namespace clerestory {

/// A closed mesh in camera space, metres; `object` names it in the results.
struct PlacedMesh {
  Mesh mesh;
  int object = 0;
};

/// A sphere of 2 * steps^2 triangles or so, with smooth normals.
Mesh sphere_mesh(const std::array<float, 3>& center, float radius, int steps = 64);

class TraceObjects {
 public:
  /// Throws Error when there is no triangle or a corner is not finite.
  TraceObjects(const Device& device, const std::vector<PlacedMesh>& meshes);
  TraceObjects(Device device, const std::vector<PlacedMesh>& meshes, const BvhForm& form);

  /// Memory of a tensor: buffer, first element, elements between batch items (lib/real.clh).
  struct Memory {
    Buffer buffer;
    std::uint64_t offset = 0;
    int stride = 0;
  };
  /// The rays of one chunk (kernels/trace/objects.cl).
  struct Rays {
    Memory points, directions;
    bool per_pixel = false;  // points are a whole map of `plane` pixels
    int plane = 0;
    int first_pixel = 0, pixels = 0, first_sample = 0, samples = 0, pixel_capacity = 0, sample_capacity = 0;
  };
  struct Hits {
    Memory distance, point, normal, object;
  };
  /// Launches; waits for nothing. `t_min` keeps rays from hitting the surface they start on.
  void meet(const Rays& rays, const Hits& hits, float t_min);

 private:
  Device device_;
  BvhForm form_;
  Buffer planes_, children_, corners_, triangles_, normals_, objects_;
};

}  // namespace clerestory
