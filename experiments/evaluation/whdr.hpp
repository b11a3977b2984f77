// How often an albedo disagrees with people about which of two points is darker.
#pragma once
#include <optional>

#include "host/io/iiw.hpp"
#include "host/io/image.hpp"

namespace clerestory {

/// Points whose lightness differs by less than this share count as equal.
constexpr double kWhdrDelta = 0.10;

/// Which of two points an albedo calls darker. Lightness of a point is the mean of the channels, as they are given, of
/// the pixel floor(y rows), floor(x columns), and 1e-10 at least; a point is darker where the other's is more than
/// 1 + delta times as much.
Darker darker_of(const Image& reflectance, const JudgedPoint& first, const JudgedPoint& second,
                 double delta = kWhdrDelta);

/// Whether a comparison counts: people agreed, it has a weight, and both points are opaque.
bool counts(const Judgements& judgements, const JudgedPair& pair);

struct Whdr {
  double rate = 0;      // weight of what is judged otherwise / weight of what counts
  double weight = 0;    // of what counts
  int counted = 0;      // comparisons
  int passed_over = 0;  // people did not agree, no weight, or a point that is not opaque
};

/// Weighted human disagreement rate (Bell et al. 2014), by darker_of. Nothing where no comparison counts.
std::optional<Whdr> whdr(const Image& reflectance, const Judgements& judgements, double delta = kWhdrDelta);

/// The same picture coded for a display, v^(1/2.2), negative values as 0: what scripts judge that read 8-bit pictures.
/// There delta is a difference of some 23 % of linear lightness.
Image display_coded(Image linear);

}  // namespace clerestory
