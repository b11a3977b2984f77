#include "experiments/bench/peak_bench.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/cl/ceilings.hpp"
#include "host/cl/tile.hpp"

namespace clerestory {

nlohmann::ordered_json bench_peak(Device& device, const BenchOptions& options) {
  const Ceilings ceilings = measure_ceilings(device);
  const std::vector<TileSpeed> speeds = measure_tiles(device);
  double peak = ceilings.fma_gflops;
  for (const TileSpeed& speed : speeds) peak = std::max(peak, speed.gflops);
  if (!options.quiet)
    fmt::print(
        "{}\npeak {:.0f} GFLOP/s: the larger of multiply-adds and the best product\n{:<8}{:>12}{:>8}{:>9}{:>6}\n",
        describe(ceilings), peak, "tile", "vectors of", "rows", "GFLOP/s", "peak");
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Tile& tile : tiles()) {
    const auto found =
        std::ranges::find_if(speeds, [&](const TileSpeed& speed) { return speed.tile.name == tile.name; });
    std::string refused;
    if (found == speeds.end())
      refused = fmt::format("not tried: the device says that its vectors hold {} floats", device.info().float_width);
    else if (!found->fault.empty())
      refused = "refused: " + found->fault;
    nlohmann::ordered_json entry{{"name", tile.name}, {"rows", tile.rows}, {"width", tile.width}};
    std::string words = refused;
    if (refused.empty()) {
      entry["gflops"] = found->gflops;
      words = fmt::format("{:>9.0f}{:>5.0f}%", found->gflops, 100 * found->gflops / peak);
    } else {
      entry["refused"] = refused;
      words = "  " + refused;
    }
    if (!options.quiet)
      fmt::print("{:<8}{:>12}{:>8}{}{}\n", tile.name, tile.width, tile.rows, words,
                 tile.name == device.tile().name ? "  in use" : "");
    list.push_back(std::move(entry));
  }
  return {{"device", device.info().name},
          {"float_width", device.info().float_width},
          {"fma_gflops", ceilings.fma_gflops},
          {"bandwidth_gbs", ceilings.bandwidth_gbs},
          {"launch_us", ceilings.launch_us},
          {"round_trip_us", ceilings.round_trip_us},
          {"peak_gflops", peak},
          {"tile", device.tile().name},
          {"tiles", std::move(list)}};
}

}  // namespace clerestory
