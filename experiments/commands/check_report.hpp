// What both forms of `clerestory check` say of devices and faults.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "checks/op_check.hpp"

namespace clerestory {

/// Where the twins in double ran; `without`: what is left of the check where none could.
std::string twins_text(const CheckedDevices& devices, const std::string& without);
/// The first twenty, a line each, and how many more there are.
std::string faults_text(const std::vector<std::string>& faults);
nlohmann::ordered_json devices_json(const CheckedDevices& devices);
/// Throws ErrorKind::Failed naming what is wrong; `what`: "op", "case".
void expect_none_wrong(const std::string& what, const std::vector<std::string>& wrong, const CheckedDevices& devices);

}  // namespace clerestory
