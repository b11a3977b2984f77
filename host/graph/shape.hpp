// Shapes of tensors: always four numbers, NCHW, so that every op speaks of the same axes.
#pragma once
#include <fmt/format.h>

#include <string>

namespace clerestory {

/// Real is float or double as the plan's precision says; Int is 32-bit (pixel indices, flags, counts).
enum class Type { Real, Int };

struct Shape {
  int n = 1, c = 1, h = 1, w = 1;

  long plane() const { return static_cast<long>(h) * w; }  // elements of one channel
  long item() const { return c * plane(); }                // elements of one batch item
  long count() const { return n * item(); }
  bool operator==(const Shape&) const = default;
  std::string text() const { return fmt::format("{}x{}x{}x{}", n, c, h, w); }
};

struct Signature {
  Shape shape;
  Type type = Type::Real;
};

}  // namespace clerestory
