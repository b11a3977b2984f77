// What a device is asked before its first use, asked again: the remembered answer may be years old.
#include "host/cl/probe.hpp"

#include "checks/kernel_check.hpp"

namespace clerestory {

KERNEL_CHECK(probe) {
  return {.stem = "probe",
          .kernels = {"probe_product", "probe_functions"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            const auto ask = [&](Device device, Precision precision) {
              if (const std::string fault = probe_fault(device, precision); !fault.empty())
                findings.faults.push_back("probe: " + fault);
            };
            ask(devices.single, Precision::Single);
            if (devices.with_doubles) ask(*devices.with_doubles, Precision::Double);
          }};
}

}  // namespace clerestory
