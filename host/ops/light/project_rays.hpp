// The pixels that directions from the camera point to (kernels/light/project_rays.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// direction {1, 3, pixels, samples}: camera frame, any length; camera {n, 4, 1, 1} of pictures of `picture`'s
/// height and width -> Int {1, 1, pixels, samples}: y * w + x of the ray's own picture, or -1 for what that does
/// not show.
Value project_rays(Value direction, Value camera, const Shape& picture);

/// The same where the picture goes on mirrored at its borders, all around: -1 for directions (0, 0, 0) alone. The
/// principal point lies in the picture.
Value mirrored_rays(Value direction, Value camera, const Shape& picture);

}  // namespace clerestory
