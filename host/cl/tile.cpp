#include "host/cl/tile.hpp"

#include <algorithm>
#include <ctime>

#include "host/cl/disk_cache.hpp"
#include "host/cl/platforms.hpp"
#include "host/cl/seconds_of.hpp"
#include "host/cl/small_integers.hpp"

namespace clerestory {
namespace {

constexpr const char* file = "tensor/tile.cl";
constexpr int panel = 8, positions = 48;  // PANEL and POSITIONS of the kernel file
constexpr int depth = 128;                // rows of the panel: 24 KiB of it, which any first cache holds
constexpr int tries = 24, most_rounds = 1 << 14;
constexpr double long_enough = 1e-3;  // seconds
constexpr int most_series = 5;
constexpr double own_share = 0.85;  // of the units' time: launching takes a few hundredths

Defines defines_of(const Tile& tile) {
  return {{"TILE_ROWS", std::to_string(tile.rows)}, {"TILE_WIDTH", std::to_string(tile.width)}};
}

std::string remembered_by(const Device& device) {
  return device.fingerprint() + driver_environment() + "\n" + kernel_source(file);
}

/// The product that tiles are measured by.
class Product {
 public:
  explicit Product(Device& device)
      : device_(device),
        items_(4 * static_cast<std::size_t>(device.info().compute_units)),
        weights_(upload(left_)),
        panel_(upload(right_)),
        sums_(device.allocate(items_ * panel * positions * sizeof(float))) {}

  /// Compiles, checks, and finds how many rounds take long enough.
  void add(const Tile& tile) {
    Candidate c{{tile, 0, {}}, device_.kernel(file, "tile_product", defines_of(tile))};
    seconds(c);  // some drivers compile at the first launch
    const auto too_short = [&] { return std::min({seconds(c), seconds(c), seconds(c)}) < long_enough; };
    while (too_short() && c.rounds < most_rounds) c.rounds *= 2;
    c.speed.fault = fault_after(c.rounds);
    candidates_.push_back(std::move(c));
  }

  /// The best of several tries each, in turns: what else the machine does for a while then hits all of them. While
  /// other programs take a part of the device there are more tries, so that each tile gets one that nobody disturbs.
  std::vector<TileSpeed> speeds() {
    for (int i = 0; i < most_series && !try_all(); ++i) {
    }
    std::vector<TileSpeed> result;
    for (const Candidate& c : candidates_) result.push_back(c.speed);
    return result;
  }

 private:
  struct Candidate {
    TileSpeed speed;
    Kernel kernel;
    int rounds = 1;
  };

  double seconds(const Candidate& c) {
    return seconds_of(
        device_, [&] { device_.launch(c.kernel, Range::of(items_, 1), weights_, panel_, sums_, depth, c.rounds); });
  }

  /// Whether this program had the device to itself meanwhile.
  bool try_all() {
    const std::clock_t before = std::clock();
    double wall = 0;
    for (int i = 0; i < tries; ++i)
      for (Candidate& c : candidates_)
        if (c.speed.fault.empty()) wall += add_try(c);
    const double own = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    return own > own_share * wall * device_.info().compute_units;
  }

  /// Its wall time.
  double add_try(Candidate& c) {
    const double work = 2e-9 * panel * positions * depth * c.rounds * static_cast<double>(items_), taken = seconds(c);
    c.speed.gflops = std::max(c.speed.gflops, work / taken);
    return taken;
  }

  Buffer upload(const std::vector<float>& values) {
    Buffer buffer = device_.allocate(values.size() * sizeof(float));
    device_.write(buffer, values.data(), buffer.bytes());
    return buffer;
  }

  std::string fault_after(int rounds) {
    std::vector<float> found(panel * positions);
    device_.read(sums_, found.data(), found.size() * sizeof(float), (items_ - 1) * found.size() * sizeof(float));
    for (int r = 0; r < panel; ++r)
      for (int p = 0; p < positions; ++p) {
        float expected = 0;
        for (int k = 0; k < depth; ++k) expected += left_[k * panel + r] * right_[k * positions + p];
        expected *= static_cast<float>(rounds);
        if (const float value = found[r * positions + p]; value != expected)
          return fmt::format("a product of whole numbers gives {} at ({}, {}) instead of {}", value, r, p, expected);
      }
    return {};
  }

  Device& device_;
  std::size_t items_;
  // Numbers of two bits: sums of most_rounds * depth products stay below 2^23, so that every one is exact.
  std::vector<float> left_ = small_integers<float>(panel * depth, 1, 2),
                     right_ = small_integers<float>(positions * depth, 2, 2);
  Buffer weights_, panel_, sums_;
  std::vector<Candidate> candidates_;
};

}  // namespace

std::span<const Tile> tiles() {
  static const std::vector<Tile> all{{"8x48", 8, 16}, {"8x24", 8, 8}, {"4x24", 4, 8}, {"8x12", 8, 4}, {"4x12", 4, 4}};
  return all;
}

std::vector<std::string> tile_choices() {
  std::vector<std::string> names{"auto"};
  for (const Tile& tile : tiles()) names.push_back(tile.name);
  return names;
}

std::vector<std::string> gemm_choices() { return {"auto", "packed", "direct", "clblast"}; }

const Tile& tile_named(const std::string& name, const std::string& key) {
  const auto found = std::ranges::find(tiles(), name, &Tile::name);
  if (found == tiles().end())
    throw usage_error("no such tile", key, name, fmt::format("one of {}", fmt::join(tile_choices(), ", ")));
  return *found;
}

Defines tile_defines(Device& device, Defines more) {
  more.merge(defines_of(device.tile()));
  return more;
}

std::vector<TileSpeed> measure_tiles(Device& device) {
  Product product(device);
  for (const Tile& tile : tiles())
    if (tile.width <= std::max(device.info().float_width, tiles().back().width)) product.add(tile);
  return product.speeds();
}

const Tile& fastest_tile(Device& device) {
  if (!device.info().cpu) return tiles().front();
  if (const auto name = DiskCache().load("tile", remembered_by(device)))
    if (const auto known = std::ranges::find(tiles(), *name, &Tile::name); known != tiles().end()) return *known;
  return remeasured_tile(device);
}

const Tile& remeasured_tile(Device& device) {
  if (!device.info().cpu) return tiles().front();
  const std::vector<TileSpeed> speeds = measure_tiles(device);
  const TileSpeed& best = *std::ranges::max_element(speeds, {}, &TileSpeed::gflops);
  if (!best.fault.empty())
    throw Error(ErrorKind::Device,
                fmt::format("every tile computes wrongly on {}: {}", device.info().name, best.fault));
  DiskCache().store("tile", remembered_by(device), best.tile.name);
  return *std::ranges::find(tiles(), best.tile.name, &Tile::name);
}

}  // namespace clerestory
