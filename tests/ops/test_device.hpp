// Devices of the tests of ops.
#pragma once
#include "checks/op_check.hpp"
#include "host/graph/plan.hpp"

namespace clerestory {

/// The default device, and one with doubles: the same where it can.
const CheckedDevices& test_devices();
Device test_device(Precision precision = Precision::Single);

}  // namespace clerestory
