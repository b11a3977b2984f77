// The networks of Li et al. 2020 ("Inverse rendering for complex indoor scenes", CVPR) as their program has them: the
// rival that ours is compared with. The first of their two cascades, without the bilateral solver that follows it.
#pragma once
#include <array>
#include <string>

#include "host/ops/light/spherical_gaussians.hpp"
#include "nets/builder.hpp"

namespace clerestory {

/// Channels that are normalised together: those of every convolution are a multiple.
inline constexpr int kLi2020Group = 16;

/// Channels of convolutions.
struct Li2020MapsSize {
  std::array<int, 6> encoder{64, 128, 256, 256, 512, 1024};
  std::array<int, 6> decoder{512, 256, 256, 128, 64, 64};
};
struct Li2020LightSize {
  std::array<int, 2> entry{32, 64};
  std::array<int, 6> encoder{128, 256, 256, 512, 512, 1024};
  std::array<int, 6> decoder{512, 512, 256, 256, 128, 128};
  int lobes = 12;
};
/// "paper" or "compact"; throw usage_error otherwise.
Li2020MapsSize li2020_maps_size(const std::string& preset);
Li2020LightSize li2020_light_size(const std::string& preset);

/// Maps of {n, 3, h, w}.
struct Li2020Maps {
  Value albedo;   // {n, 3, h, w}: [0, 1]
  Value normal;   // {n, 3, h, w}: unit, camera space
  Value rough;    // {n, 1, h, w}: [-1, 1]; roughness is half of it plus a half
  Value depth;    // {n, 1, h, w}: [0, 1], relative
  Value deepest;  // {n, C, h / 32, w / 32}: the encoder's last features
};
/// `image`: linear radiance, 95th percentile of luminance 0.9, clamped to [0, 1]; at least 32 pixels high and wide.
/// States are named as in their program.
Li2020Maps li2020_maps(const Scope& scope, Value image, const Li2020MapsSize& size);

/// Cells of the light's grid over a picture of h x w: a half along either side.
constexpr int li2020_cells(int pixels) { return pixels / 2; }

/// What the light's net says of the grid, before it means anything: all {n, ., h / 2, w / 2}.
struct Li2020Lobes {
  Value axis;       // 3 K: unit, in the frame of the hemisphere above the cell
  Value sharpness;  // K: [0, 1]
  Value weight;     // 3 K: [0, 1]
};
/// `image` as above, beside the maps of it, all {n, ., h, w}; at least 64 pixels high and wide. No gradient goes to
/// them.
Li2020Lobes li2020_lobes(const Scope& scope, Value image, const Li2020Maps& maps, const Li2020LightSize& size);

/// The light that they mean, in camera space: numbers up to tan(0.999 pi / 2), axes turned by the mean of `normal` {n,
/// 3, h, w} over each cell.
Gaussians li2020_gaussians(const Li2020Lobes& lobes, Value normal);

}  // namespace clerestory
