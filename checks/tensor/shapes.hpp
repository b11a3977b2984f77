// What references of tensor ops share: planes computed element by element, and shapes that broadcast.
#pragma once
#include <vector>

#include "host/graph/tensor.hpp"

namespace clerestory {

/// y {n, c, h, w} of f(item, channel, row, column), for the items and channels of `s`.
template <class F>
Tensor over(const Shape& s, int h, int w, F f) {
  Tensor y({s.n, s.c, h, w});
  for (int n = 0; n < s.n; ++n)
    for (int c = 0; c < s.c; ++c)
      for (int j = 0; j < h; ++j)
        for (int i = 0; i < w; ++i) y.at(n, c, j, i) = f(n, c, j, i);
  return y;
}

/// A shape and all that broadcast to it: batch, channels and plane each there or 1.
inline constexpr Shape kFull{2, 3, 5, 7};
inline const std::vector<Shape> kBroadcasts{kFull,        {1, 3, 5, 7}, {2, 1, 5, 7}, {2, 3, 1, 1},
                                            {1, 3, 1, 1}, {2, 1, 1, 1}, {1, 1, 5, 7}, {1, 1, 1, 1}};

/// The element of a tensor of such a shape that meets (n, c, y, x) of the full one.
template <class T>
decltype(auto) broadcast(T& t, int n, int c, int y, int x) {
  const bool plane = t.shape.plane() > 1;
  return t.at(t.shape.n > 1 ? n : 0, t.shape.c > 1 ? c : 0, plane ? y : 0, plane ? x : 0);
}

}  // namespace clerestory
