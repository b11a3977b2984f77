// A bounding volume hierarchy for kernels/trace/bvh.clh. Embree's builder decides the tree; it traces nothing.
#pragma once
#include <cstdint>
#include <vector>

#include "host/cl/device.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// Children of a node, and triangles of a leaf, that the kernel tests at once, and entries of its stack. On a CPU a
/// work-item fills a vector and the stack holds the whole walk; on a GPU 64 work-items walk side by side, and what the
/// stack (a power of two) cannot hold is found again.
struct BvhForm {
  int width = 16, stack = 192;

  static BvhForm wide() { return {16, 192}; }
  static BvhForm short_stack(int entries = 8) { return {4, entries}; }
  static BvhForm of(const Device& device) {
    return device.info().cpu || !short_stack().fits(device) ? wide() : short_stack();
  }

  /// Whether the device has groups of so many work-items.
  bool fits(const Device& device) const;
  /// Of programs that walk such a hierarchy.
  Defines defines() const;
  /// A launch of such a program over a grid.
  Range range(std::size_t x, std::size_t y = 1) const;
};

/// Arrays as the kernel reads them, each row `form.width` wide:
/// node n: `planes` rows 6n..6n+5 are lower x, y, z, upper x, y, z; `children` row n holds, per child, a node (>= 0)
/// or a leaf ~l (< 0); unused children have an empty box.
/// leaf l: `corners` rows 9l..9l+8 are x, y, z of the first, the second and the third corner, bit for bit the scene's;
/// `triangles` row l holds their numbers, -1 where unused (three corners in one place, never hit).
struct Bvh {
  BvhForm form;
  std::vector<float> planes;
  std::vector<std::int32_t> children;
  std::vector<float> corners;
  std::vector<std::int32_t> triangles;
  int depth = 0;  // levels of nodes
};

/// Throws Error when the scene is empty, a coordinate is not finite, or the tree is too deep, or too large, to be
/// walked.
Bvh build_bvh(const std::vector<Triangle>& triangles, const BvhForm& form);

/// Appends leaves that hold just these triangles and belong to no node, for tests against a subset; gives the first
/// one's number.
int append_leaves(Bvh& bvh, const std::vector<Triangle>& triangles, const std::vector<int>& subset);

}  // namespace clerestory
