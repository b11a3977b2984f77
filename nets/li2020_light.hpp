// The light of Li et al. 2020 in a picture: their net on pictures as ours read them, and their rendering layer, a fixed
// grid of 8 x 16 directions over each cell's hemisphere and a surface model of their own.
#pragma once
#include "nets/li2020.hpp"
#include "nets/light_inputs.hpp"

namespace clerestory {

/// What the net says of `pictures`, whose image it sees clamped to [0, 1] and whose depth in parts of its mean: lobes
/// of cells in camera space, {n, ., h / 2, w / 2}. How bright the light is is not learned: li2020_as_bright().
Gaussians li2020_light(const Scope& scope, const LightInputs& pictures, const Li2020LightSize& size);

/// What surfaces reflect of it, {1, 3, h / 2, w / 2}; black without depth and where a normal faces away.
struct Li2020Shaded {
  Value diffuse, specular;
};
/// `picture` is one, with its maps and camera; `lobes` of its cells.
Li2020Shaded li2020_shaded(const Gaussians& lobes, const LightInputs& picture);

/// Weights of the lobes times the one number, of two steps that are in [0.001, 1000] each, by which the picture
/// rendered again comes nearest to the picture (least squares over cells that do not emit), both clamped to [0, 1]. No
/// gradient.
Gaussians li2020_as_bright(const Gaussians& lobes, const LightInputs& picture);

/// Their `LSregressDiffSpec`: diffuse and specular by the two coefficients that bring their sum nearest to `image`
/// where that is below 0.9; where these are not told apart (determinant over 3 pixels at most 0.01) the diffuse one
/// alone; then by the one of the sum, clamped to [0, 1], itself. All of {1, 3, h, w}; no gradient goes to the
/// coefficients.
Li2020Shaded li2020_rescaled(const Li2020Shaded& shaded, Value image);

/// {1, 1, h / 2, w / 2}: the share of each cell that has depth and does not emit.
Value li2020_lit_cells(const LightInputs& picture);
/// The mean of the picture over each cell, clamped to [0, 1].
Value li2020_seen_cells(const LightInputs& picture);
/// clamp(diffuse + specular, 0, 1).
Value li2020_shown(const Li2020Shaded& shaded);

}  // namespace clerestory
