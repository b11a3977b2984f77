// Sums and products of tensors. In two-tensor ops `b` may have size 1 along the batch, the channels or the plane
// (height and width together), and is then repeated to the shape of `a`.
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

Value add(Value a, Value b, double weight = 1);           // a + weight * b
Value subtract(Value a, Value b);                         // a - b
Value multiply(Value a, Value b);                         // a * b
Value affine(Value a, double factor, double offset = 0);  // factor * a + offset
inline Value scale(Value a, double factor) { return affine(a, factor); }
/// factor * b, repeated to `shape`.
Value expand(Value b, const Shape& shape, double factor = 1);

}  // namespace clerestory
