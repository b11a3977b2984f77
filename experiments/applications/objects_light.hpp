// Light that inserted objects throw back: the scene's own light, and objects in its way that reflect it and each other.
#pragma once
#include <memory>

#include "host/ops/shade/render.hpp"
#include "nets/scene_light.hpp"
#include "tracer/trace_objects.hpp"

namespace clerestory {

/// The whole-map values that objects_light() asks render() to hand in, in this order, before those of the light.
struct ObjectsLightInputs {
  Value depth, pyramid, normal;  // of the scene without objects
  Value range, points;           // its range; surface points of what is shaded, {1, 3, h, w}
  Value skip;                    // Int {1, 1, h, w}: the pixel that a pixel's rays do not hit, or -1
  Value shows;                   // {1, 1, h, w}: 1 where a pixel shows an object
  Value materials;               // {objects, 5, 1, 1}: albedo, roughness, metallic
};
std::vector<Value> inputs_of(const ObjectsLightInputs& inputs, const SceneLight& light);

/// The scene's light with objects before it. Rays that hit an object are scattered there up to `bounces` times; those
/// that leave it are answered by the scene's light again. Pixels that show the scene get the difference that the
/// objects make, pixels that show an object its radiance. It traces rays itself, those that change nothing not at all:
/// RenderSpec::trace is not needed.
LightBuilder objects_light(std::shared_ptr<TraceObjects> objects, const SceneLight& light, const SsrtOptions& ssrt,
                           int bounces);

}  // namespace clerestory
