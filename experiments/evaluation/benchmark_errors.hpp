// Errors as other groups' scripts compute them, each by its own conventions. Images are planar; a mask above 0.5 marks
// a pixel that counts. Without such a pixel there is no figure.
#pragma once
#include <optional>

#include "host/io/image.hpp"

namespace clerestory {

/// Whether predicted normals are made unit length first. Li et al.'s script takes them as resizing leaves them.
enum class Lengths { Unit, AsTheyAre };
struct AngleErrors {
  double mean = 0, median = 0;  // degrees
};
/// Between predicted and true normals, the true ones made unit length. As they are: the arc cosine of their product,
/// clamped to [-1, 1]. A predicted normal without length counts as 90 degrees.
std::optional<AngleErrors> normal_angles(const Image& predicted, const Image& truth, const Image& mask,
                                         Lengths lengths);

/// Limits of the depths that count, metres, without the limits themselves.
constexpr double kNearestJudged = 1, kFarthestJudged = 10;
/// Mean over pixels of true depth within the limits of the squared difference of ln(predicted + 1e-20) and ln(true),
/// each less its own mean over all pixels that have a true depth. Li et al.'s script reports its root; each method's
/// free scale has no effect. Negative predictions count as 0.
std::optional<double> centred_log_error(const Image& predicted, const Image& truth);

/// Mean squared difference over valid pixels and all channels.
std::optional<double> masked_mse(const Image& predicted, const Image& truth, const Image& mask);
/// The s within 0.001 and 1000 that makes s predicted - truth least in the mean of squares.
double fitted_scale(const Image& predicted, const Image& truth, const Image& mask);
/// Mean over valid pixels of (ln(1 + s predicted) - ln(1 + true))^2, s by fitted_scale, negative predictions as 0.
std::optional<double> scaled_log_depth_error(const Image& predicted, const Image& truth, const Image& mask);

/// Decibels over all pixels and channels of pictures with values up to 1; infinite where they are equal.
double psnr(const Image& predicted, const Image& truth);
/// What becomes of the places whose window reaches over the border: they do not count, as in scikit-image and in
/// torchmetrics 1.3; or the picture goes on mirrored about its outermost pixels, as in torchmetrics 1.6 to 1.9.
enum class Border { LeftOut, Mirrored };
/// Structural similarity (Wang et al. 2004) of pictures with values up to 1: Gaussian window of deviation 1.5 and 11
/// pixels, K1 0.01, K2 0.03, mean over places and channels. Throws usage_error where the picture is smaller than the
/// window.
double ssim(const Image& predicted, const Image& truth, Border border);

}  // namespace clerestory
