// `clerestory check --stability` (checks/stability): whether a build is numerically stable on stiff and extreme cases.
#pragma once
#include "checks/op_check.hpp"
#include "experiments/commands/cli.hpp"

namespace clerestory {

/// `only`: groups, empty: all. Throws ErrorKind::Failed when a row breaks its bar.
void check_stability_of(const CheckedDevices& devices, const std::vector<std::string>& only,
                        const CommonOptions& common);

/// Groups of cases, in the order of the table.
std::vector<std::string> stability_groups();

}  // namespace clerestory
