// The register tile of matrix products on CPUs (kernels/lib/tile.clh), and which one a device is fastest with. A device
// does not say how many registers it has, and what it says of their width need not be what its compiler uses: so tiles
// are tried.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "host/cl/device.hpp"

namespace clerestory {

/// `rows` outputs times three vectors of `width` numbers. All tiles give the same bits.
struct Tile {
  std::string name;  // outputs x positions: "8x48"
  int rows = 0, width = 0;
};

/// For 32 registers (8 rows) and 16 (4 rows) of 512, 256 and 128 bits.
std::span<const Tile> tiles();
/// Throws usage_error with the list; `key` is the option or key that asked.
const Tile& tile_named(const std::string& name, const std::string& key);
/// "auto" and the names, as a list of choices.
std::vector<std::string> tile_choices();
/// Who may multiply (Device::use_gemm): auto, packed (our own kernels), direct (these without minimal filtering),
/// clblast.
std::vector<std::string> gemm_choices();

/// The defines of a program that multiplies in the device's tile, and those given.
Defines tile_defines(Device& device, Defines more = {});

struct TileSpeed {
  Tile tile;
  double gflops = 0;  // of products, 10^9 a second
  std::string fault;  // why it is refused: it computes wrongly
};
/// A short product in every tile whose vectors are no wider than the device says its own are. Some milliseconds each,
/// beside the driver's compiling; five times as long while other programs keep the device busy.
std::vector<TileSpeed> measure_tiles(Device& device);

/// The fastest of these. Measured once per device, driver and kernel source, then remembered beside the verdicts of the
/// probe. On a device that is no CPU, whose kernels have no such tile, the first of the list.
const Tile& fastest_tile(Device& device);
/// The same, measured now.
const Tile& remeasured_tile(Device& device);

}  // namespace clerestory
