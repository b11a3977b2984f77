// Errors of predicted maps against true ones, and of the best constant a view allows. Plain arithmetic in double over
// planar float images (channel, row, column); a mask value above 0.5 marks a valid pixel.
//
// An error is absent (std::nullopt) when no pixel is valid: such a view does not count for that metric.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/io/image.hpp"
#include "host/math/vec.hpp"

namespace clerestory {

/// Predicted relative depths below this count as this: the logarithm of zero has no place in a mean.
constexpr double least_relative_depth = 1e-3;

/// Mean angle in degrees between two fields of directions (3 channels, made unit length here). A predicted vector
/// without length counts as 90 degrees.
std::optional<double> mean_angle(const Image& predicted, const Image& truth, const Image& mask);

/// Root of the scale-invariant logarithmic error (Eigen et al. 2014, eq. 4 with lambda = 1): the standard deviation
/// over valid pixels of ln max(predicted, least_relative_depth) - ln truth. A global factor between the two has no
/// effect. Truth must be positive where the mask is set.
std::optional<double> rooted_si_log(const Image& predicted, const Image& truth, const Image& mask);

/// min over one scale s >= 0 per image of mean (s predicted - truth)^2 over valid pixels and channels.
std::optional<double> scale_invariant_mse(const Image& predicted, const Image& truth, const Image& mask);

/// Mean squared difference over the valid pixels of channel `channel` of both images.
std::optional<double> channel_mse(const Image& predicted, const Image& truth, const Image& mask, int channel);

/// The direction with the least mean angle to the valid normals of `truth`: descends (Weiszfeld's algorithm on the
/// sphere, Fletcher et al. 2009) from the best of a grid of directions and from the mean direction. Nothing without
/// valid pixels.
std::optional<Vec3> best_constant_normal(const Image& truth, const Image& mask);

/// The maps MGNet speaks of, predicted or true, on one pixel grid. Albedo linear; normals in camera space, [-1, 1];
/// depth relative to scene_scale; material: roughness, metallic.
struct MapSet {
  Image albedo, normal, depth, material;  // 3, 3, 1, 2 channels
};

/// Pixels at which each kind of map is known (method: segGeo, segAlb, segMat).
struct MapMasks {
  Image geometry, albedo, material;
};

/// The five figures of `clerestory evaluate`, in this order everywhere.
enum class MapError { Normal, Depth, Albedo, Roughness, Metallic };
constexpr int map_error_count = 5;
struct MapErrorInfo {
  const char* key;   // "normal_degrees": in metrics.jsonl and JSON
  const char* name;  // "normals"
  const char* unit;
  const char* convention;  // what exactly is computed, for the table's foot
};
const MapErrorInfo& info(MapError error);
using MapErrors = std::array<std::optional<double>, map_error_count>;

MapErrors map_errors(const MapSet& predicted, const MapSet& truth, const MapMasks& masks);

/// Errors of the constant that is best for this view under each metric: least mean angle; any depth; the mean albedo;
/// mean roughness; mean metallic. No blind predictor that answers one value per view can be better.
MapErrors best_constant_errors(const MapSet& truth, const MapMasks& masks);

}  // namespace clerestory
