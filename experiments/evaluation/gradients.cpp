#include "experiments/evaluation/gradients.hpp"

#include <cmath>
#include <numbers>

#include "host/error.hpp"

namespace clerestory {
namespace {

using Numbers = std::vector<double>;

/// The orthonormal cosine transform of n numbers (DCT-II): [k][i].
Numbers cosines(int n) {
  Numbers matrix;
  for (int k = 0; k < n; ++k)
    for (int i = 0; i < n; ++i)
      matrix.push_back(std::sqrt((k == 0 ? 1.0 : 2.0) / n) * std::cos(std::numbers::pi * k * (i + 0.5) / n));
  return matrix;
}

/// Rows of `values` (count of them, n long) transformed, and transposed: {n, count}. `back`: by the transposed matrix,
/// which is the inverse.
Numbers transformed(const Numbers& values, int count, int n, const Numbers& matrix, bool back) {
  Numbers out(values.size());
  for (int row = 0; row < count; ++row)
    for (int k = 0; k < n; ++k) {
      double total = 0;
      for (int i = 0; i < n; ++i)
        total += matrix[static_cast<std::size_t>(back ? i * n + k : k * n + i)] *
                 values[static_cast<std::size_t>(row * n + i)];
      out[static_cast<std::size_t>(k * count + row)] = total;
    }
  return out;
}

/// Eigenvalue k of the differences of n numbers.
double eigenvalue(int k, int n) { return 2 - 2 * std::cos(std::numbers::pi * k / n); }

}  // namespace

GridGradients gradients_of(const Numbers& values, int width, int height) {
  const auto at = [&](int x, int y) { return values.at(static_cast<std::size_t>(y * width + x)); };
  GridGradients g{width, height, {}, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x + 1 < width; ++x) g.right.push_back(at(x + 1, y) - at(x, y));
  for (int y = 0; y + 1 < height; ++y)
    for (int x = 0; x < width; ++x) g.down.push_back(at(x, y + 1) - at(x, y));
  return g;
}

Numbers integrated(const GridGradients& g) {
  const int w = g.width, h = g.height;
  Numbers flow(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));  // what flows out of each point
  const auto at = [&](int x, int y) -> double& { return flow[static_cast<std::size_t>(y * w + x)]; };
  std::size_t i = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x + 1 < w; ++x, ++i) at(x, y) -= g.right.at(i), at(x + 1, y) += g.right[i];
  i = 0;
  for (int y = 0; y + 1 < h; ++y)
    for (int x = 0; x < w; ++x, ++i) at(x, y) -= g.down.at(i), at(x, y + 1) += g.down[i];
  const Numbers across = cosines(w), along = cosines(h);
  Numbers waves = transformed(transformed(flow, h, w, across, false), w, h, along, false);
  for (int l = 0; l < h; ++l)
    for (int k = 0; k < w; ++k) {
      double& wave = waves[static_cast<std::size_t>(l * w + k)];
      wave = k + l == 0 ? 0 : wave / (eigenvalue(k, w) + eigenvalue(l, h));
    }
  return transformed(transformed(waves, h, w, across, true), w, h, along, true);
}

}  // namespace clerestory
