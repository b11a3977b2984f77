// The directions of a room from one photograph: what lines of walls, floors and furniture agree on, by the known camera
// (Coughlan & Yuille 1999; Denis et al. 2008; lines as by Grompone von Gioi et al. 2010).
#pragma once
#include <vector>

#include "host/io/image.hpp"
#include "host/math/camera.hpp"

namespace clerestory {

/// A straight edge in a picture, between two positions in pixels with fractions.
struct LineSegment {
  Vec2 from, to;
  double length() const { return glm::distance(from, to); }
};
/// Regions of pixels whose brightness on a screen changes in one direction, as far as they are long and thin.
/// `picture`: linear, clamped to [0, 1].
std::vector<LineSegment> line_segments(const Image& picture);

/// Normal of the plane through the camera and a segment: at right angles to what the segment is in space.
Vec3 plane_of(const LineSegment& segment, const Camera& camera);
/// How well a line in such a plane fits a direction in space, 1 to 0; both of length one.
double line_fit(const Vec3& plane, const Vec3& direction);

/// Three directions at right angles that the lines follow, as columns, in camera space: right, up and backwards as far
/// as the camera is upright and looks ahead. Without lines the camera's own. People hold cameras nearly upright:
/// between frames that the lines like as well, the one with less roll and pitch is chosen.
Mat3 manhattan_frame(const std::vector<LineSegment>& lines, const Camera& camera);

}  // namespace clerestory
