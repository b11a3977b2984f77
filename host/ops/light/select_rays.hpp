// Which rays of a tile need a part of the light: a compacted list, so that nets are asked for no more than these
// (kernels/light/select_rays.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Rays p * S + s of a tensor {1, C, P, S}, in ascending order. No values: all rays of the tile.
struct RayList {
  Value rays;   // Int {1, 1, P, S}: the first `count` numbers are the list, the others are -1
  Value count;  // Int {1, 1, 1, 1}
  explicit operator bool() const { return static_cast<bool>(rays); }
};

/// InView: the ray hits a pixel and u < 1 - epsilon. OutOfView: u > epsilon. A share of Eq. 6 (Zhu et al. 2022) of at
/// most epsilon is thus left out; with epsilon 0 only shares that are 0 are.
enum class LightPart { InView, OutOfView };
/// For epsilon: every ray is listed, in view if it hits.
inline constexpr double kEveryRay = -1;

/// u {1, 1, P, S} and hit Int {1, 1, P, S} as ssrt() gives them, direction {1, 3, P, S}: (0, 0, 0) is no ray and never
/// listed, nor are rays beyond the chunk. 0 <= epsilon < 1, or kEveryRay. Counted per block, summed, placed: same list
/// run to run and on any device. No gradient: the list is discrete.
RayList select_rays(Value u, Value hit, Value direction, LightPart part, double epsilon);

/// For ops that ask listed rays. Throws Error unless list and count are a RayList's of rays of this shape.
void check_list(const Value& list, const Value& count, const Shape& rays, const char* op);
/// Zeros in the output, for rays that a list leaves out.
void clear_output(Launch& launch);

}  // namespace clerestory
