// What ops of whole pictures have in common.
#pragma once
#include <span>
#include <string>

#include "host/graph/graph.hpp"

namespace clerestory {

/// Throws Error (Failed) naming the op unless each value is {1, channels[k], h, w} of the first one's size.
inline void check_pictures(std::span<const Value> in, std::span<const int> channels, const std::string& op) {
  const Shape& first = in[0].shape();
  for (std::size_t k = 0; k < in.size(); ++k) {
    const Shape wanted{1, channels[k], first.h, first.w};
    if (!(in[k].shape() == wanted))
      throw Error(ErrorKind::Failed, "a picture of another shape", op, in[k].shape().text(), wanted.text());
  }
}

}  // namespace clerestory
