// A wide bounding volume hierarchy for kernels/trace/bvh.clh. Embree's builder decides the tree; it traces nothing.
#pragma once
#include <cstdint>
#include <vector>

#include "tracer/scene.hpp"

namespace clerestory {

/// Children of a node, and triangles of a leaf, that the kernel tests at once.
inline constexpr int kBvhWidth = 16;
/// Entries of the traversal stack in kernels/trace/bvh.clh.
inline constexpr int kBvhStack = 192;

/// Arrays as the kernel reads them, each row kBvhWidth wide:
/// node n: `planes` rows 6n..6n+5 are lower x, y, z, upper x, y, z; `children` row n holds, per child, a node (>= 0)
/// or a leaf ~l (< 0); unused children have an empty box.
/// leaf l: `corners` rows 9l..9l+8 are x, y, z of the first, the second and the third corner, bit for bit the scene's;
/// `triangles` row l holds their numbers, -1 where unused (three corners in one place, never hit).
struct Bvh {
  std::vector<float> planes;
  std::vector<std::int32_t> children;
  std::vector<float> corners;
  std::vector<std::int32_t> triangles;
  int depth = 0;  // levels of nodes
};

/// Throws Error when the scene is empty, a coordinate is not finite, or the tree needs more than kBvhStack entries.
Bvh build_bvh(const std::vector<Triangle>& triangles);

/// Appends leaves that hold just these triangles and belong to no node, for tests against a subset; gives the first
/// one's number.
int append_leaves(Bvh& bvh, const std::vector<Triangle>& triangles, const std::vector<int>& subset);

}  // namespace clerestory
