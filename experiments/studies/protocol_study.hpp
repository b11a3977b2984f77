// Maps judged as Zhu et al. 2022, table 1, judge them (evaluation/benchmark.hpp): normals and depth on NYUv2, WHDR of
// albedo on IIW, and their figures for rooms. The data are rooms whose content no training has seen, written as those
// sets lie on disk, and the sets themselves where their folders are named. Judged are ours, a rival where
// one is named, simple methods that learn nothing, and one value for all pixels.
#pragma once
#include <string>
#include <vector>

#include "host/io/config.hpp"

namespace clerestory {

/// Keys of its own.
void add_protocol_keys(Schema& schema);

/// study.kind = "protocol". Returns the run directory. Throws usage_error where weights or a named data set are
/// missing.
std::string run_protocol_study(const Config& config, const std::vector<std::string>& command);

}  // namespace clerestory
