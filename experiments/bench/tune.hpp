// `clerestory tune`: a search for CLBlast's parameters on a device, and whether our kernels or CLBlast are faster
// there.
#pragma once
#include <string>
#include <vector>

#include "experiments/bench/clblast_meter.hpp"
#include "host/graph/shape.hpp"

namespace clerestory {

/// A convolution with padding that keeps its size, in all three passes.
struct TunedLayer {
  Shape x, w;
};

struct TuneOptions {
  double minutes = 20;                // at most
  bool again = false;                 // forgets what was measured
  int most_sets = 0;                  // that this call measures; 0: as many as there is time for
  std::vector<Product> small, large;  // sets are measured by these: Xgemm by the large ones, XgemmDirect by the small
  std::vector<Product> products;      // compared at the end, with the layers
  std::vector<TunedLayer> layers;
  int rounds = 4;  // of every comparison
};

/// With the sizes of the nets.
TuneOptions tune_options();

/// Measures the device's tile and CLBlast's parameters, as far as time allows; compares CLBlast with its own
/// parameters, CLBlast with those found, and our kernels, and keeps what came of it in the user's file. A search that
/// was interrupted goes on. The parameters take the place of CLBlast's own only if all results are exact, if they are
/// faster by more than CLBlast's own differ from themselves, and if no product loses more than that. Throws
/// ErrorKind::Interrupted after Ctrl-C with all measured sets kept.
Tuning tune(Device& device, const TuneOptions& options);

/// Whether a tuning is that of the device, this CLBlast and these kernels, and its search was over.
bool is_finished(const Tuning& tuning);

struct DirectOrNot {
  double volume = 0, direct = 0, indirect = 0;  // seconds
};
/// From which size on (cube root of rows * columns * depth) the indirect kernel is to be used; `own` where that does
/// not lose against the best.
std::size_t indirect_from(std::vector<DirectOrNot> products, std::size_t own);

/// As a table in GFLOP/s, with what `auto` takes.
std::string tuning_text(const TuningInUse& used);

}  // namespace clerestory
