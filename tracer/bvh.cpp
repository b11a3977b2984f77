#include "tracer/bvh.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr int kMostWidth = 16;
constexpr std::size_t kShortGroup = 64;  // work-items that share a short stack's local memory: kernels/trace/bvh.clh
// Of a walk with a short stack: levels of its trail, and nodes or leaves that an entry can name.
constexpr int kMostLevels = 32, kMostNamed = 1 << 25;

struct Box {
  glm::vec3 lower, upper;
};

/// What Embree's callbacks build; it lives in Embree's arena until the tree is flattened.
struct Tree {
  int count = 0;
  bool leaf = false;
  Tree* child[kMostWidth] = {};
  Box box[kMostWidth] = {};
  unsigned triangle[kMostWidth] = {};
};

Tree* new_tree(RTCThreadLocalAllocator allocator) {
  return new (rtcThreadLocalAlloc(allocator, sizeof(Tree), 16)) Tree;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned count, void*) {
  Tree* tree = new_tree(allocator);
  tree->count = static_cast<int>(count);
  return tree;
}

void set_children(void* node, void** children, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i) static_cast<Tree*>(node)->child[i] = static_cast<Tree*>(children[i]);
}

void set_bounds(void* node, const RTCBounds** bounds, unsigned count, void*) {
  for (unsigned i = 0; i < count; ++i) {
    const RTCBounds& b = *bounds[i];
    static_cast<Tree*>(node)->box[i] = {{b.lower_x, b.lower_y, b.lower_z}, {b.upper_x, b.upper_y, b.upper_z}};
  }
}

void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* primitives, size_t count, void*) {
  Tree* tree = new_tree(allocator);
  tree->leaf = true;
  tree->count = static_cast<int>(count);
  for (size_t i = 0; i < count; ++i) tree->triangle[i] = primitives[i].primID;
  // The order inside a leaf decides ties between equal distances; make it independent of Embree's threads.
  std::sort(tree->triangle, tree->triangle + count);
  return tree;
}

std::vector<RTCBuildPrimitive> bounds_of(const std::vector<Triangle>& triangles) {
  std::vector<RTCBuildPrimitive> primitives(triangles.size());
  for (size_t i = 0; i < triangles.size(); ++i) {
    const Vertex* v = triangles[i].v;
    const glm::vec3 lower = glm::min(v[0].position, glm::min(v[1].position, v[2].position));
    const glm::vec3 upper = glm::max(v[0].position, glm::max(v[1].position, v[2].position));
    const float sum = lower.x + lower.y + lower.z + upper.x + upper.y + upper.z;
    if (!std::isfinite(sum)) {
      throw Error(ErrorKind::Failed, "a corner is not finite", "triangle " + std::to_string(i));
    }
    primitives[i] = {lower.x, lower.y, lower.z, 0, upper.x, upper.y, upper.z, static_cast<unsigned>(i)};
  }
  return primitives;
}

/// How far boxes stand off their triangles. The kernel sees a corner at distance r from the ray's origin up to three
/// epsilon of r off: translation, shear and its product round by half an epsilon each, twice where the shear is 1;
/// areas that round to zero add one. Of a slab's distance, 1 / d, two products and their difference round by half an
/// epsilon each, near and far: four. r is at most the farthest corner's distance from zero and the origin's; this is
/// the corners' share, the kernel adds the origin's.
float margin(const std::vector<Triangle>& triangles) {
  float farthest = 0;
  for (const Triangle& t : triangles)
    for (const Vertex& v : t.v)
      for (int axis = 0; axis < 3; ++axis) farthest = std::max(farthest, std::abs(v.position[axis]));
  return 8 * std::numeric_limits<float>::epsilon() * farthest;
}

class Flattener {
 public:
  Flattener(const std::vector<Triangle>& triangles, Bvh& bvh)
      : triangles_(triangles), bvh_(bvh), margin_(margin(triangles)) {}

  /// Appends a node with its subtree; gives its number. `waiting`: stack entries held while it is visited.
  int node(const Tree& tree, int level, int waiting) {
    bvh_.depth = std::max(bvh_.depth, level);
    check_depth(level, waiting + tree.count);
    const int width = bvh_.form.width, number = static_cast<int>(bvh_.children.size()) / width;
    const size_t planes = bvh_.planes.size();
    bvh_.planes.resize(planes + static_cast<size_t>(6 * width));
    bvh_.children.resize(bvh_.children.size() + static_cast<size_t>(width), 0);
    for (int c = 0; c < width; ++c) {
      const bool used = c < tree.count;
      for (int axis = 0; axis < 3; ++axis) {
        bvh_.planes[planes + axis * width + c] = used ? tree.box[c].lower[axis] - margin_ : 1e30f;
        bvh_.planes[planes + (3 + axis) * width + c] = used ? tree.box[c].upper[axis] + margin_ : -1e30f;
      }
    }
    for (int c = 0; c < tree.count; ++c) {
      const Tree& child = *tree.child[c];
      const int reference = child.leaf ? ~leaf(child) : node(child, level + 1, waiting + tree.count - 1);
      bvh_.children[static_cast<size_t>(number) * width + c] = reference;
    }
    return number;
  }

  int leaf(const Tree& tree) {
    const std::vector<int> numbers(tree.triangle, tree.triangle + tree.count);
    return append_leaves(bvh_, triangles_, numbers);
  }

 private:
  void check_depth(int level, int entries) const {
    const bool dropping = bvh_.form.width == 4;
    const int found = dropping ? level : entries, most = dropping ? kMostLevels : bvh_.form.stack;
    if (found > most)
      throw Error(ErrorKind::Failed, "the hierarchy is too deep for the traversal stack", "scene",
                  std::to_string(found), "at most " + std::to_string(most));
  }

  const std::vector<Triangle>& triangles_;
  Bvh& bvh_;
  float margin_;
};

}  // namespace

int append_leaves(Bvh& bvh, const std::vector<Triangle>& triangles, const std::vector<int>& subset) {
  const auto width = static_cast<std::size_t>(bvh.form.width);
  const int first = static_cast<int>(bvh.triangles.size() / width);
  for (std::size_t k = 0; k < subset.size(); ++k) {
    const std::size_t lane = k % width;
    if (lane == 0) {
      bvh.corners.resize(bvh.corners.size() + 9 * width, 0.f);
      bvh.triangles.resize(bvh.triangles.size() + width, -1);
    }
    const Triangle& t = triangles[static_cast<std::size_t>(subset[k])];
    float* corners = &bvh.corners[bvh.corners.size() - 9 * width];
    for (std::size_t row = 0; row < 9; ++row)
      corners[row * width + lane] = t.v[row / 3].position[static_cast<int>(row % 3)];
    bvh.triangles[bvh.triangles.size() - width + lane] = subset[k];
  }
  return first;
}

bool BvhForm::fits(const Device& device) const { return width == 16 || device.info().max_group >= kShortGroup; }

Defines BvhForm::defines() const {
  if (width == 16) return {};
  return {{"BVH_WIDTH", std::to_string(width)}, {"BVH_STACK", std::to_string(stack)}};
}

Range BvhForm::range(std::size_t x, std::size_t y) const {
  if (width == 16) return Range::of2(x, y, 1);
  Range range = y > 1 ? Range::of2(x, y, 8, 8) : Range::of(x, kShortGroup);
  range.together = true;
  return range;
}

Bvh build_bvh(const std::vector<Triangle>& triangles, const BvhForm& form) {
  if (triangles.empty()) throw Error(ErrorKind::Failed, "a scene without triangles cannot be traced");
  std::vector<RTCBuildPrimitive> primitives = bounds_of(triangles);

  using DeviceHandle = std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)>;
  using BvhHandle = std::unique_ptr<RTCBVHTy, decltype(&rtcReleaseBVH)>;
  // One thread: room-sized scenes build in milliseconds, and the tree must not depend on timing.
  const DeviceHandle device(rtcNewDevice("threads=1"), rtcReleaseDevice);
  if (!device) throw Error(ErrorKind::Failed, "Embree's builder does not start");
  const BvhHandle arena(rtcNewBVH(device.get()), rtcReleaseBVH);

  RTCBuildArguments arguments = rtcDefaultBuildArguments();
  arguments.buildQuality = RTC_BUILD_QUALITY_MEDIUM;
  const auto width = static_cast<unsigned>(form.width);
  arguments.maxBranchingFactor = width;
  arguments.maxDepth = 64;
  arguments.sahBlockSize = width;     // triangles of a leaf are tested at once
  arguments.minLeafSize = width / 2;  // measured on rooms of 1,000 to 20,000 triangles, 16 wide
  arguments.traversalCost = 2;
  arguments.maxLeafSize = width;
  arguments.bvh = arena.get();
  arguments.primitives = primitives.data();
  arguments.primitiveCount = arguments.primitiveArrayCapacity = primitives.size();
  arguments.createNode = create_node;
  arguments.setNodeChildren = set_children;
  arguments.setNodeBounds = set_bounds;
  arguments.createLeaf = create_leaf;
  const Tree* root = static_cast<const Tree*>(rtcBuildBVH(&arguments));
  if (!root) throw Error(ErrorKind::Failed, "Embree's builder failed");

  Bvh bvh;
  bvh.form = form;
  Flattener flatten(triangles, bvh);
  if (!root->leaf) {
    flatten.node(*root, 1, 0);
  } else {  // still gets a root node, so that the kernel knows one case only
    Tree node;
    node.count = 1;
    node.child[0] = const_cast<Tree*>(root);
    node.box[0] = {glm::vec3(-1e30f), glm::vec3(1e30f)};
    flatten.node(node, 1, 0);
  }
  if (form.width == 4 && std::max(bvh.children.size(), bvh.triangles.size()) / width > kMostNamed)
    throw Error(ErrorKind::Failed, "the hierarchy is too large for the traversal stack", "scene",
                std::to_string(triangles.size()) + " triangles");
  return bvh;
}

}  // namespace clerestory
