// Devices as they are, probed or not: who they are, and whether a short kernel shows a fault of theirs.
#pragma once
#include <string>
#include <vector>

namespace clerestory {

/// Identity of device, driver and compiler, of each of list_devices().
std::vector<std::string> device_fingerprints();

/// Runs kernel void reproduce(global int *wrong, const int many) of an OpenCL C source: many = 70001, 16 work-items of
/// one group, wrong[16] all 0 before. Gives what is shown: wrong[0] where it is not 0 then, or the driver's error;
/// empty when nothing is. Throws ErrorKind::Device when there is no device of that index.
std::string shown_by(const std::string& source, int index);

}  // namespace clerestory
