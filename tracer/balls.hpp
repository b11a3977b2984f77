// Balls put into a view: truth for inserted objects.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tracer/room.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

struct BallKind {
  std::string name;
  float albedo, roughness, metallic;
};
/// mirror: metal of roughness 0.02; glossy: metal of 0.2; diffuse: albedo 0.8.
const std::vector<BallKind>& ball_kinds();

/// Radii that a ball's centre is above what it stands on: clear of its surface by more than rounding.
inline constexpr double kBallLift = 1.002;

struct BallPlace {
  Vec3 center{0};  // camera space, metres
  double radius = 0;
};

/// A place on something that faces up, in view and clear of everything else; the radius is about a ninth of the
/// picture's height as seen. Nothing when the view has no such place. `world`: what the scene was made of.
std::optional<BallPlace> place_ball(TraceScene& scene, const World& world, const Camera& camera, Random random);

/// The same material everywhere, its albedo as given.
Material uniform_material(const glm::vec3& albedo, float roughness, float metallic);

/// The scene with one more mesh of a camera's space, smooth by its normals.
World with_mesh(const World& scene, const Camera& camera, const Mesh& mesh, const Material& material);

/// The scene with one more ball.
World with_ball(const World& scene, const Camera& camera, const BallPlace& place, const BallKind& kind);

}  // namespace clerestory
