// How far a picture is from the truth.
#pragma once
#include <vector>

#include "experiments/evaluation/radiance_error.hpp"
#include "host/io/image.hpp"

namespace clerestory {

/// Over the channels of `used` pixels.
RadianceError picture_error(const Image& picture, const Image& truth, const std::vector<bool>& used);
/// An oracle, which reads the truth: of the best multiple of each channel of `picture`, for each of relmse, smape, psnr
/// and shown_psnr by itself. The logarithms' are those of the multiple that is best in smape.
RadianceError best_scaled_error(const Image& picture, const Image& truth, const std::vector<bool>& used);

/// relMSE (eps 0.01) of the picture of which x and y are independent estimates, as a and b are of the truth: mean of
/// the products of their differences over the square of the truth's mean + 0.01. Its expectation holds no variance, so
/// it may fall below 0 by chance.
double relmse_of_pair(const Image& x, const Image& y, const Image& a, const Image& b, const std::vector<bool>& used);

}  // namespace clerestory
