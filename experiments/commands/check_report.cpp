#include "experiments/commands/check_report.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/io/json_file.hpp"

namespace clerestory {
namespace {

constexpr std::size_t kShownFaults = 20;

nlohmann::ordered_json device_json(const Device& device) {
  const DeviceInfo& info = device.info();
  return {{"index", info.index}, {"name", info.name}, {"platform", info.platform}, {"driver", info.driver}};
}

}  // namespace

std::string twins_text(const CheckedDevices& devices, const std::string& without) {
  if (!devices.with_doubles) return "It has no doubles, and no other device here has: " + without;
  if (devices.twins_run_elsewhere())
    return "It has no doubles: the twins in double ran on " + devices.with_doubles->info().name + ".";
  return "The twins in double ran on it too.";
}

std::string faults_text(const std::vector<std::string>& faults) {
  std::string text;
  for (std::size_t i = 0; i < std::min(faults.size(), kShownFaults); ++i) text += faults[i] + "\n";
  if (faults.size() > kShownFaults)
    text += fmt::format("{} further faults (--json names all)\n", faults.size() - kShownFaults);
  return text;
}

nlohmann::ordered_json devices_json(const CheckedDevices& devices) {
  nlohmann::ordered_json all{{"device", device_json(devices.single)}, {"twins", nullptr}};
  if (devices.with_doubles) all["twins"] = device_json(*devices.with_doubles);
  return all;
}

void expect_none_wrong(const std::string& what, const std::vector<std::string>& wrong, const CheckedDevices& devices) {
  if (wrong.empty()) return;
  throw Error(
      ErrorKind::Failed,
      fmt::format("{} wrong: {}",
                  wrong.size() == 1 ? fmt::format("one {} is", what) : fmt::format("{} {}s are", wrong.size(), what),
                  fmt::join(wrong, ", ")),
      devices.single.info().name);
}

}  // namespace clerestory
