// The OpenCL devices of this machine and the choice among them. Private to host/cl.
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/cl/device.hpp"

typedef struct _cl_device_id* cl_device_id;

namespace clerestory {

struct FoundDevice {
  DeviceInfo info;
  std::string platform_version;  // names the compiler on some platforms (PoCL: its LLVM)
  cl_device_id id = nullptr;
  std::optional<std::size_t> lost_after = {};  // launches; what is pretended (pretend.hpp)
};

/// Devices of every platform that can be used: available, with a compiler. Never throws for a platform's sake; throws
/// ErrorKind::Usage for a wrong CLERESTORY_PRETEND.
std::vector<FoundDevice> find_devices();

/// Those whose index equals `selector` (digits), or whose platform or name contains it, letter case ignored; all when
/// it is empty.
std::vector<FoundDevice> matching_devices(const std::vector<FoundDevice>& devices, const std::string& selector);

/// Of device, driver and compiler.
std::string fingerprint_of(const FoundDevice& device);

/// What the environment tells drivers, which may change what they compile: "NAME=value" of each variable, sorted.
std::string driver_environment();

/// "0: pthread-... (Portable Computing Language); 1: ..."
std::string describe_devices(const std::vector<FoundDevice>& devices);

/// Whether a platform's name is PoCL's.
bool is_pocl(const std::string& platform);

/// "CL_OUT_OF_RESOURCES (-5)".
std::string opencl_error_name(int code);

}  // namespace clerestory
