// Generated views as people meet pictures: their maps predicted by MGNet in place of the true ones.
#pragma once
#include <filesystem>

#include "host/cl/device.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// The scene of `truth`'s photograph and camera with all maps predicted as `invert` does: depth in metres by the
/// predicted scale, no pixel flagged as emitting, for a picture in linear units has no white.
Scene predicted_scene(Device& device, const std::filesystem::path& weights, const Scene& truth);

/// Brings the depth to `metres` at an image position, as `invert --known` does. Nothing is known there: no change.
void scale_depth(Scene& scene, const Vec2& at, double metres);

}  // namespace clerestory
