// What materials are put together of, whoever puts them together: colours, roughness, textures.
#pragma once
#include "tracer/random.hpp"
#include "tracer/scene.hpp"

namespace clerestory {

/// Patterns of Texture::Print (kernels/trace/texture.clh).
enum Print { Stripes, Tartan, Dots, Damask, Flowers, Zigzag, Rings, Patches, Text, Blocks, Mosaic, Basket, Clouds };
constexpr int kPrints = 13;

/// Linear colour from hue in turns, saturation and value, all of the gamma-encoded colour.
glm::vec3 hsv(float hue, float saturation, float value);
/// Linear grey from the gamma-encoded one.
glm::vec3 grey(float value);

/// A material of that texture with a seed of its own; the rest is the caller's.
Material textured(Texture texture, Random& random);

/// No darker than anything at home is.
void colors(Material& m, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c);
void roughness(Material& m, float a, float b, float c);

}  // namespace clerestory
