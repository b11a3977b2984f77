#include "tracer/trace_objects.hpp"

#include <cmath>
#include <numbers>

namespace clerestory {
namespace {

template <class T>
Buffer upload(Device& device, const std::vector<T>& data) {
  Buffer buffer = device.allocate(data.size() * sizeof(T));
  device.write(buffer, data.data(), data.size() * sizeof(T));
  return buffer;
}

glm::vec3 vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// Of a triangle without area, which no ray meets, zero.
glm::vec3 face_normal(const Triangle& t) {
  const glm::dvec3 a(t.v[0].position), n = glm::cross(glm::dvec3(t.v[1].position) - a, glm::dvec3(t.v[2].position) - a);
  const double length = glm::length(n);
  return length > 0 ? glm::vec3(n / length) : glm::vec3(0);
}

}  // namespace

Mesh sphere_mesh(const std::array<float, 3>& center, float radius, int steps) {
  Mesh mesh;
  const int columns = 2 * steps;
  for (int row = 0; row <= steps; ++row) {
    const float theta = std::numbers::pi_v<float> * static_cast<float>(row) / static_cast<float>(steps);
    const float out = row < steps ? std::sin(theta) : 0.f;  // poles are one point, seams close bit for bit
    for (int column = 0; column <= columns; ++column) {
      const int k = column % columns;
      const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(k) / static_cast<float>(columns);
      const std::array<float, 3> n{out * std::sin(phi), std::cos(theta), out * std::cos(phi)};
      mesh.normals.push_back(n);
      mesh.positions.push_back({center[0] + radius * n[0], center[1] + radius * n[1], center[2] + radius * n[2]});
    }
  }
  const auto at = [&](int row, int column) { return static_cast<std::uint32_t>(row * (columns + 1) + column); };
  for (int row = 0; row < steps; ++row)
    for (int column = 0; column < columns; ++column) {
      if (row > 0) mesh.indices.push_back({at(row, column), at(row + 1, column), at(row, column + 1)});
      if (row + 1 < steps) mesh.indices.push_back({at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)});
    }
  return mesh;
}

TraceObjects::TraceObjects(const Device& device, const std::vector<PlacedMesh>& meshes)
    : TraceObjects(device, meshes, BvhForm::of(device)) {}

TraceObjects::TraceObjects(Device device, const std::vector<PlacedMesh>& meshes, const BvhForm& form)
    : device_(std::move(device)), form_(form) {
  std::vector<Triangle> triangles;
  std::vector<float> normals;
  std::vector<std::int32_t> objects;
  for (const PlacedMesh& placed : meshes)
    for (const auto& corners : placed.mesh.indices) {
      Triangle& t = triangles.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) {
        t.v[i].position = vec(placed.mesh.positions.at(corners[i]));
        const auto& n = placed.mesh.normals.at(corners[i]);
        normals.insert(normals.end(), n.begin(), n.end());
      }
      const glm::vec3 face = face_normal(t);
      normals.insert(normals.end(), {face.x, face.y, face.z});
      objects.push_back(placed.object);
    }
  const Bvh bvh = build_bvh(triangles, form);
  planes_ = upload(device_, bvh.planes), children_ = upload(device_, bvh.children);
  corners_ = upload(device_, bvh.corners), triangles_ = upload(device_, bvh.triangles);
  normals_ = upload(device_, normals), objects_ = upload(device_, objects);
}

void TraceObjects::meet(const Rays& rays, const Hits& hits, float t_min) {
  std::vector<Arg> args{planes_, children_, corners_, triangles_, normals_, objects_};
  for (const Memory* m : {&rays.points, &rays.directions, &hits.distance, &hits.point, &hits.normal, &hits.object})
    args.emplace_back(m->buffer), args.emplace_back(m->offset), args.emplace_back(m->stride);
  for (const int number : {rays.first_pixel, rays.pixels, rays.first_sample, rays.samples, rays.pixel_capacity,
                           rays.sample_capacity, static_cast<int>(rays.per_pixel), rays.plane})
    args.emplace_back(number);
  args.emplace_back(t_min);
  const Range range = form_.range(static_cast<std::size_t>(rays.samples), static_cast<std::size_t>(rays.pixels));
  device_.launch_with(device_.kernel("trace/objects.cl", "meet_objects", form_.defines()), range, args);
}

}  // namespace clerestory
