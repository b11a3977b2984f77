// The table that `clerestory devices` prints.
#pragma once
#include <string>
#include <vector>

#include "host/cl/device.hpp"

namespace clerestory {

/// One line per device under a heading, columns aligned, ending in a newline.
std::string device_table(const std::vector<DeviceInfo>& devices);

}  // namespace clerestory
