// The product that register tiles are measured by, in each of them: whole numbers, whose every digit must be right.
#include "host/cl/tile.hpp"

#include "checks/kernel_check.hpp"

namespace clerestory {

KERNEL_CHECK(tile) {
  return {.stem = "tile",
          .kernels = {"tile_product"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            Device device = devices.single;
            for (const Tile& tile : tiles())
              if (const std::string fault = tile_fault(device, tile); !fault.empty())
                findings.faults.push_back(fmt::format("tile {}: {}", tile.name, fault));
          }};
}

}  // namespace clerestory
