// Probes: the light that arrives at points in the free air of a room.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "host/io/light_files.hpp"
#include "tracer/random.hpp"
#include "tracer/trace_scene.hpp"

namespace clerestory {

/// Probes stand at least this far from every surface, metres.
inline constexpr double kProbeClearance = 0.15;

/// Distance from a point of the world to the nearest triangle, exact, metres; infinite in an empty world.
double distance_to_surface(const World& world, const Vec3& point);

/// Up to `count` places (panoramas empty) in free air, kProbeClearance from everything. Three of four lie between the
/// camera and what a pixel shows, the others anywhere that two straight flights from the camera lead to; so all are in
/// the air that the camera is in, never inside furniture. Probe k is the same however many are asked for, as long as
/// each finds a place; where one does not, there are fewer. `maps` are scene.maps(camera) of `world`.
std::vector<Probe> place_probes(TraceScene& scene, const World& world, const Camera& camera, const TraceMaps& maps,
                                int count, const Random& random);

/// Fills a probe's panorama, unscaled. Textures are averaged over a texel's angle. query.to_world and query.spread are
/// not read.
void trace_probe(TraceScene& scene, const Camera& camera, Probe& probe, const RadianceQuery& query,
                 DroppedSamples* dropped = nullptr);

/// The mean of two estimates of query.spp samples each, from two seeds (query.seed is not read). Returns the variance
/// of that mean, {3, h, w}, unbiased, from how the two differ.
Image trace_probe_twice(TraceScene& scene, const Camera& camera, Probe& probe, RadianceQuery query,
                        const std::array<std::uint32_t, 2>& seeds);

}  // namespace clerestory
