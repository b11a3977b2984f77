#include "tests/ops/test_device.hpp"

namespace clerestory {

const CheckedDevices& test_devices() {
  static const CheckedDevices devices = [] {
    const CheckedDevices found = checked_devices(Device::open());
    if (found.with_doubles) return found;
    throw Error(ErrorKind::Device, "no device here has doubles: the reference twins cannot run", "tests");
  }();
  return devices;
}

Device test_device(Precision precision) {
  return precision == Precision::Single ? test_devices().single : *test_devices().with_doubles;
}

}  // namespace clerestory
