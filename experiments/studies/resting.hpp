// Objects that rest on a surface of the true room, as a method with maps of its own sees them rest there.
#pragma once
#include "experiments/applications/insert.hpp"

namespace clerestory {

/// The object on the surface that `scene`'s depth says is where `known`, the truth, has it, as large as it looks in the
/// picture: what --at does. `object` has at_point, a ball's centre or a mesh's lowest point, in camera space. As it was
/// where a depth is not known, or its foot is out of the picture.
InsertedObject resting_on(const Scene& scene, const Scene& known, InsertedObject object);

}  // namespace clerestory
