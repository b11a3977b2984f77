#include "experiments/commands/devices.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "experiments/commands/cli.hpp"
#include "host/cl/device.hpp"
#include "host/cl/device_table.hpp"
#include "host/io/json_file.hpp"
#include "host/report/terminal.hpp"

namespace clerestory {
namespace {

std::string devices_json(const std::vector<DeviceInfo>& devices) {
  auto list = nlohmann::ordered_json::array();
  for (const DeviceInfo& d : devices)
    list.push_back({{"index", d.index},
                    {"name", d.name},
                    {"platform", d.platform},
                    {"vendor", d.vendor},
                    {"version", d.version},
                    {"driver", d.driver},
                    {"cpu", d.cpu},
                    {"fp64", d.fp64},
                    {"unified_memory", d.unified_memory},
                    {"compute_units", d.compute_units},
                    {"max_group", d.max_group},
                    {"memory", d.memory},
                    {"max_allocation", d.max_allocation},
                    {"local_memory", d.local_memory}});
  // Drivers may name themselves in any encoding.
  return json_text(list);
}

}  // namespace

void add_devices_command(CommandLine& line) {
  line.add("devices", "List the OpenCL devices")
      .common({Common::Json, Common::Quiet})
      .run([](const CommonOptions& common) {
        const std::vector<DeviceInfo> devices = list_devices();
        if (common.json) write_json_result(common, devices_json(devices));
        if (devices.empty()) throw Error(ErrorKind::Device, why_no_device());
        if (!common.json || !common.json->empty()) std::fputs(terminal_text(device_table(devices)).c_str(), stdout);
      });
}

}  // namespace clerestory
