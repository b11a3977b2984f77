// Sums over a pixel's samples, and the standard error of their mean (kernels/shade/accumulate_samples.cl).
#pragma once
#include "host/graph/graph.hpp"

namespace clerestory {

/// Columns {1, C, pixels, 1}; all but `first` add up over chunks of samples.
struct SampleSums {
  Value mean;     // 3: sum of weight * radiance over `count`
  Value squares;  // 3: sum of squared deviations from the chunk's mean
  Value tally;    // 4: sum of u; directions; samples dropped (NaN or Inf); hits
  Value first;    // 1: one plus the first sample dropped; 0: none was
};

/// weight and radiance {1, 3, pixels, samples}, pdf {1, 1, ...} (0: no direction); u and hit_pixel of ssrt(), or no
/// values. `count`: samples of a pixel over all chunks. Gradients go from the mean to weight and radiance.
SampleSums accumulate_samples(Value weight, Value radiance, Value pdf, Value u, Value hit_pixel, int count);

struct SampleStatistics {
  /// {n, 3, h, w}: of the mean, if samples are independent. Of Sobol's points it is an upper bound: over 48 seeds the
  /// spread of a rough wall's pixels is 0.57 of it in median at 64 samples, 0.43 at 256 (which
  /// Render.StandardErrorBoundsTheSpreadOfSobolPoints asserts). Independently scrambled copies of fewer points would
  /// tell their own error, and have more of it.
  Value standard_error;
  Value uncertainty;  // {n, 1, h, w}: mean u over the directions drawn; 0 where there are none
};

/// From whole maps of the sums. `chunks`: chunks of samples a pixel's samples came in (each takes one degree of
/// freedom).
SampleStatistics finish_samples(Value squares, Value tally, int count, int chunks);

}  // namespace clerestory
