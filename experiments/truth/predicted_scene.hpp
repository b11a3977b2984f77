// Generated views as people meet pictures: a photograph that a camera clips, maps predicted by MGNet.
#pragma once
#include <filesystem>

#include "host/cl/device.hpp"
#include "nets/scene.hpp"

namespace clerestory {

/// What a camera makes of exposed radiance: clamped to [0, 1], in 256 steps of the curve 1/2.2, linear again.
Image camera_picture(const Image& exposed);

/// The scene of a photograph and its camera with all maps predicted as `invert` does, depth in metres by the predicted
/// scale. `clipped`: by a camera, so that white means emission; a picture in linear units flags no pixel.
Scene predicted_scene(Device& device, const std::filesystem::path& weights, const Image& photo, const Camera& camera,
                      bool clipped);

/// Brings the depth to `metres` at an image position, as `invert --known` does. Nothing is known there: no change.
void scale_depth(Scene& scene, const Vec2& at, double metres);

}  // namespace clerestory
