// Pictures from their gradients.
#pragma once
#include <vector>

namespace clerestory {

/// Differences between neighbours of a grid of numbers, row-major: `right` (width - 1) x height, `down` width x
/// (height - 1).
struct GridGradients {
  int width = 0, height = 0;
  std::vector<double> right, down;
};
GridGradients gradients_of(const std::vector<double>& values, int width, int height);

/// The grid with the least squared distance of its differences from these, of mean 0: Poisson's equation with nothing
/// flowing over the border, solved exactly by cosine transforms.
std::vector<double> integrated(const GridGradients& gradients);

}  // namespace clerestory
