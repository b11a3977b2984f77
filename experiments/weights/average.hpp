// The mean of weights that have learned from one another: legs of one training that end in as many corners of one
// valley are often worse than its middle (Izmailov et al. 2018; Wortsman et al. 2022, "model soups").
#pragma once
#include "experiments/weights/weights.hpp"

namespace clerestory {

/// The mean, in double, of each state of the maps' weights or checkpoints `files`, running statistics of batch
/// normalisation (presets compact and paper) included, which only training makes those of the mean. Mean maps are the
/// last file's. The history has the legs of all, by the time they began, side branches too; of a leg that several tell
/// of, what ran longest; then one of no steps, whose `init` names the files and their hashes. Nobody has judged the
/// mean: a training of one step at train.rate=0 does. Throws usage_error: fewer than two files, another net or size of
/// view than the first's, no training behind one of them, or a first leg that is not the first's: such weights have
/// nothing to do with each other.
LoadedWeights average_weights(const std::vector<std::filesystem::path>& files, Device device);

}  // namespace clerestory
