#include "host/cl/device_table.hpp"

#include <algorithm>
#include <array>

namespace clerestory {
namespace {

using Row = std::array<std::string, 9>;

std::string bytes_text(std::size_t bytes) {
  const double kibi = static_cast<double>(bytes) / 1024;
  if (kibi < 1024) return fmt::format("{:.0f} KiB", kibi);
  if (kibi < 1024 * 1024) return fmt::format("{:.0f} MiB", kibi / 1024);
  return fmt::format("{:.1f} GiB", kibi / 1024 / 1024);
}

Row row(const DeviceInfo& d) {
  return {std::to_string(d.index),
          d.name,
          d.cpu ? "CPU" : "GPU",
          std::to_string(d.compute_units),
          bytes_text(d.memory),
          bytes_text(d.local_memory),
          d.fp64 ? "yes" : "no",
          d.platform,
          d.driver};
}

}  // namespace

std::string device_table(const std::vector<DeviceInfo>& devices) {
  std::vector<Row> rows = {{"#", "device", "kind", "units", "memory", "local", "double", "platform", "driver"}};
  for (const DeviceInfo& device : devices) rows.push_back(row(device));
  std::array<std::size_t, std::tuple_size_v<Row>> widths{};
  for (const Row& r : rows)
    for (std::size_t c = 0; c < r.size(); ++c) widths[c] = std::max(widths[c], r[c].size());
  std::string table;
  for (const Row& r : rows) {
    std::string line;
    for (std::size_t c = 0; c < r.size(); ++c) line += fmt::format("{:<{}}  ", r[c], widths[c]);
    table += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return table;
}

}  // namespace clerestory
