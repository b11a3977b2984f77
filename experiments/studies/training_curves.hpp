// Error against training seconds, as a finished training remembers it.
#pragma once
#include <filesystem>
#include <vector>

#include "host/report/plot.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// Each validation of the run's leg on each list of rooms: steps, seconds of training (on a CPU processor time over
/// cores; judging does not count), the ratio to the best trivial answers, each error. The rows of two trainings that
/// differ in seeds have the same words.
Table training_curve(const std::filesystem::path& run);

/// Of such tables below each other, the first `named` columns saying whose they are: for each list of rooms the ratio
/// against seconds, a curve for each training.
std::vector<Plot> training_curve_plots(const Table& curves, std::size_t named);

}  // namespace clerestory
