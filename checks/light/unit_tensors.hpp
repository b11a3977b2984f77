// Vectors of length one, three channels each.
#pragma once
#include <array>
#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {

using Vector3 = std::array<double, 3>;

/// v / |v|; (0, 0, 1) for the zero vector.
inline Vector3 unit_of(const Vector3& v) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return length > 0 ? Vector3{v[0] / length, v[1] / length, v[2] / length} : Vector3{0, 0, 1};
}

/// Any directions {n, 3 K, h, w}: channels 3 k, 3 k + 1 and 3 k + 2 are one.
inline Tensor unit_tensor(const Shape& shape, std::uint64_t seed) {
  Tensor t = random_tensor(shape, seed);
  for (int n = 0; n < shape.n; ++n)
    for (int k = 0; 3 * k < shape.c; ++k)
      for (int y = 0; y < shape.h; ++y)
        for (int x = 0; x < shape.w; ++x) {
          const Vector3 unit = unit_of({t.at(n, 3 * k, y, x), t.at(n, 3 * k + 1, y, x), t.at(n, 3 * k + 2, y, x)});
          for (int c = 0; c < 3; ++c) t.at(n, 3 * k + c, y, x) = unit[static_cast<std::size_t>(c)];
        }
  return t;
}

}  // namespace clerestory
