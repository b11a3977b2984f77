// What one device makes of every kernel: checked in processes of its own, failures beside the drivers' faults that are
// known, and kept until anything changes that the verdict hangs on.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "experiments/commands/check_devices.hpp"
#include "host/cl/device.hpp"

namespace clerestory {

/// Every kernel variant that the program was seen to launch, in the tests and by commands (tests/variants.sh), as
/// text_of(KernelVariant).
inline constexpr const char* kVariantsName = "checks/variants.txt";
std::vector<std::string> listed_variants();

/// {device, quick, state: right | wrong | refused, why, kernels: [{kernel, cases, in_double, value_ulps,
/// gradient_ulps, faults}], failures: [{kernel, fault, explained}], seconds, kept}.
nlohmann::ordered_json verdict_on(const DeviceInfo& info, const DevicesOptions& options);

}  // namespace clerestory
