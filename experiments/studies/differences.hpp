// Swept tables with, beside each error, how far it is from the first variant's.
#pragma once
#include <cstddef>

#include "host/report/table.hpp"

namespace clerestory {

/// `table` as sweep_tables() makes it: its first `named` columns say what was swept, perhaps with a column "runs" after
/// them. After each column of which a best is marked comes the difference to the row of the same words that belongs to
/// the first row's variant. "none": seeds alone bring about so much once in twenty times or more often, by Welch's
/// test; "one seed": there is no spread to compare with. A table of one variant stays as it is.
Table with_differences(const Table& table, std::size_t named);

}  // namespace clerestory
