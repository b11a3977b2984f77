// The product that register tiles are measured by, in each of them: whole numbers, whose every digit must be right.
#include "host/cl/tile.hpp"

#include "checks/kernel_check.hpp"
#include "host/cl/small_integers.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kPanel = 8, kPositions = 48;  // PANEL and POSITIONS of the kernel file
constexpr std::size_t kDepth = 29, kItems = 3;
constexpr int kRounds = 2;

/// Each item's sums are the same; a number behind the last stays.
template <class Real>
void product(Device device, const Tile& tile, OpFindings& findings) {
  constexpr Precision precision = sizeof(Real) == 4 ? Precision::Single : Precision::Double;
  const std::vector<Real> left = small_integers<Real>(kPanel * kDepth, 1, 4),
                          right = small_integers<Real>(kPositions * kDepth, 2, 4);
  std::vector<double> want;
  for (std::size_t item = 0; item < kItems; ++item)
    for (std::size_t r = 0; r < kPanel; ++r)
      for (std::size_t p = 0; p < kPositions; ++p) {
        double sum = 0;
        for (std::size_t k = 0; k < kDepth; ++k)
          sum += static_cast<double>(left[k * kPanel + r]) * static_cast<double>(right[k * kPositions + p]);
        want.push_back(kRounds * sum);
      }
  want.push_back(12345.5);
  const Buffer sums = uploaded(device, std::vector<Real>(want.size(), static_cast<Real>(want.back())));
  const Defines defines{{"TILE_ROWS", std::to_string(tile.rows)}, {"TILE_WIDTH", std::to_string(tile.width)}};
  device.launch(device.kernel("tensor/tile.cl", "tile_product", defines, precision), Range::of(kItems, 1),
                uploaded(device, left), uploaded(device, right), sums, static_cast<int>(kDepth), kRounds);
  expect_close(findings, "tile " + tile.name, downloaded<Real>(device, sums), want, 0);
}

}  // namespace

KERNEL_CHECK(tile) {
  return {.stem = "tile",
          .kernels = {"tile_product"},
          .run = [](const CheckedDevices& devices, OpFindings& findings, bool) {
            for (const Tile& tile : tiles()) {
              product<float>(devices.single, tile, findings);
              if (devices.with_doubles) product<double>(*devices.with_doubles, tile, findings);
            }
          }};
}

}  // namespace clerestory
