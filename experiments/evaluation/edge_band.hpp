// Where a view's maps step: errors there say how sharp predicted maps are, which means over all pixels hide.
#pragma once
#include "experiments/evaluation/metrics.hpp"

namespace clerestory {

/// Neighbours in a row or a column, both valid, that differ by more than this have an edge between them.
constexpr double edge_albedo = 0.1, edge_material = 0.1;  // in any channel
constexpr double edge_degrees = 15;                       // of normals
constexpr double edge_depth = 1.05;                       // times the nearer depth

/// Of each mask the pixels that are no farther than `reach` rows and columns from one beside an edge: of normals or
/// depth in `geometry`, of albedo in `albedo`, of roughness or metallic in `material`.
MapMasks edge_bands(const MapSet& truth, const MapMasks& masks, int reach);

/// The pixels of each mask that are not in the other.
MapMasks without(const MapMasks& masks, const MapMasks& other);

}  // namespace clerestory
