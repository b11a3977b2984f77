// Triangle meshes from glTF 2.0 (.gltf, .glb), Draco-compressed or not.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace clerestory {

/// All primitives of the default scene in one mesh, node transforms applied; units and axes as in the file (glTF:
/// metres, y up).
struct Mesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 3>> normals;          // unit, one per vertex; weighted by area where the file has none
  std::vector<std::array<float, 2>> uvs;              // one per vertex, or empty when no primitive has any
  std::vector<std::array<std::uint32_t, 3>> indices;  // triangles, counter-clockwise seen from outside
};

/// Lowest and highest corner.
struct Extent {
  std::array<float, 3> low{}, high{};
};
Extent bounds(const Mesh& mesh);

/// Triangles, strips and fans are read, points and lines refused. Throws usage_error naming the file: missing, no glTF,
/// truncated, an index or accessor out of range, a position that is not finite, no triangle, a cycle of nodes, a buffer
/// that lies neither in the file's folder nor below it.
Mesh read_mesh(const std::filesystem::path& path);

}  // namespace clerestory
