// Which parameters of CLBlast's kernels to measure next: its own, then sets that are known to suit some processor, then
// the neighbours of the best so far, until none of them is better.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "host/tuning/tuning.hpp"

namespace clerestory {

struct ClblastTrial {
  ClblastValues values;
  double gain = 0;    // geometric mean over products: seconds by CLBlast's own parameters over seconds by these
  double least = 0;   // of these ratios
  std::string fault;  // not empty: refused
};

/// The kernels that copy and transpose what the product reads are searched as one, by the name "Copies".
struct ClblastSearch {
  std::string kernel;  // Xgemm, XgemmDirect or Copies
  ClblastValues own;   // CLBlast's
  std::vector<ClblastTrial> trials;

  /// Follows from the trials alone, so that a search goes on where it was left; nothing when it is over.
  std::optional<ClblastValues> next() const;
  /// The largest gain of those that lose nowhere more than a twentieth; CLBlast's own before anything was tried.
  ClblastValues best() const;
  double best_gain() const;
};

/// Whether the kernel can be compiled and is right with these, by the constraints of CLBlast's own tuners (1.5.3), and
/// with square tiles alone under GEMMK=1: that release is wrong with others.
bool valid_values(const std::string& kernel, const ClblastValues& values);

}  // namespace clerestory
