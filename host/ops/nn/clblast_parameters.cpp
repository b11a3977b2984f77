#include "host/ops/nn/clblast_parameters.hpp"

#include <clblast.h>

#include <mutex>
#include <unordered_map>

namespace clerestory {
namespace {

constexpr const char* kernels[] = {"Xgemm", "XgemmDirect", "GemmRoutine", "Copy", "Pad", "Transpose", "Padtranspose"};
constexpr clblast::Precision precision = clblast::Precision::kSingle;

struct Held {
  ClblastParameters own, now;
  bool chosen = false;
};

cl_device_id id_of(const Device& device) {
  cl_device_id id = nullptr;
  if (clGetCommandQueueInfo(device.queue(), CL_QUEUE_DEVICE, sizeof id, &id, nullptr) != CL_SUCCESS)
    throw Error(ErrorKind::Device, "the queue does not say its device", device.info().name);
  return id;
}

/// Nets may run from several threads.
std::mutex& guard() {
  static std::mutex one;
  return one;
}

/// Asked for before the first of them is replaced: CLBlast does not give its own back.
Held& held(cl_device_id id) {
  static std::unordered_map<cl_device_id, Held> all;
  if (const auto known = all.find(id); known != all.end()) return known->second;
  Held found;
  for (const char* kernel : kernels) {
    std::unordered_map<std::string, std::size_t> values;
    if (const auto status = clblast::RetrieveParameters(id, kernel, precision, values);
        status != clblast::StatusCode::kSuccess)
      throw Error(ErrorKind::Device, fmt::format("CLBlast has no parameters of {}", kernel), "CLBlast",
                  fmt::format("status {}", static_cast<int>(status)));
    found.own[kernel] = {values.begin(), values.end()};
  }
  found.now = found.own;
  return all[id] = std::move(found);
}

void set(cl_device_id id, Held& h, const std::string& kernel, const ClblastValues& values) {
  if (h.now.at(kernel) == values) return;
  const auto status = clblast::OverrideParameters(id, kernel, precision, {values.begin(), values.end()});
  if (status != clblast::StatusCode::kSuccess)
    throw usage_error(fmt::format("CLBlast does not take these parameters of {}", kernel), "CLBlast",
                      fmt::format("status {}", static_cast<int>(status)));
  h.now[kernel] = values;
}

void use(cl_device_id id, Held& h, const ClblastParameters& parameters) {
  for (const auto& [kernel, values] : parameters)
    if (!h.own.contains(kernel)) throw usage_error("CLBlast's matrix product has no such kernel", "CLBlast", kernel);
  for (const auto& [kernel, own] : h.own) set(id, h, kernel, parameters.contains(kernel) ? parameters.at(kernel) : own);
  h.chosen = true;
}

}  // namespace

ClblastParameters clblast_defaults(Device& device) {
  const std::lock_guard lock(guard());
  return held(id_of(device)).own;
}

void use_clblast_parameters(Device& device, const ClblastParameters& parameters) {
  const std::lock_guard lock(guard());
  const cl_device_id id = id_of(device);
  use(id, held(id), parameters);
}

ClblastParameters tuned_parameters(const Device& device) {
  const auto used = tuning_in_use(device);
  return used && used->tuning.clblast_version == clblast_version() ? used->tuning.clblast : ClblastParameters{};
}

void use_tuned_parameters(Device& device) {
  const std::lock_guard lock(guard());
  const cl_device_id id = id_of(device);
  if (Held& h = held(id); !h.chosen) use(id, h, tuned_parameters(device));
}

}  // namespace clerestory
