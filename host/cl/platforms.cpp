#include "host/cl/platforms.hpp"

#include <dlfcn.h>

#include <CL/opencl.hpp>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <utility>

#include "host/cl/pocl_cache.hpp"
#include "host/cl/pretend.hpp"
#include "host/environment.hpp"

namespace clerestory {
namespace {

// Some drivers hand back the terminating zero, or pad the name with spaces.
std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\0' || std::isspace(static_cast<unsigned char>(text.back()))))
    text.pop_back();
  text.erase(0, std::min(text.find_first_not_of(" \t\n"), text.size()));
  return text;
}

bool has_extension(const cl::Device& device, const std::string& name) {
  return (" " + device.getInfo<CL_DEVICE_EXTENSIONS>() + " ").find(" " + name + " ") != std::string::npos;
}

FoundDevice describe(const cl::Platform& platform, const cl::Device& device) {
  FoundDevice found;
  DeviceInfo& info = found.info;
  info.platform = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
  info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  info.cpu = (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0;
  info.fp64 = has_extension(device, "cl_khr_fp64");
  cl_bool unified = CL_FALSE;
  device.getInfo(CL_DEVICE_HOST_UNIFIED_MEMORY, &unified);
  info.unified_memory = unified == CL_TRUE;
  info.compute_units = static_cast<int>(device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>());
  info.float_width = static_cast<int>(std::max(device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>(),
                                               device.getInfo<CL_DEVICE_PREFERRED_VECTOR_WIDTH_FLOAT>()));
  info.max_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
  info.memory = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.max_allocation = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.local_memory = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  found.platform_version = trimmed(platform.getInfo<CL_PLATFORM_VERSION>());
  found.id = device();
  return found;
}

bool usable(const cl::Device& device) {
  return device.getInfo<CL_DEVICE_AVAILABLE>() == CL_TRUE &&
         device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() == CL_TRUE &&
         device.getInfo<CL_DEVICE_TYPE>() != CL_DEVICE_TYPE_CUSTOM;
}

std::vector<cl::Platform> all_platforms() {
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return {};  // the loader found no driver (-1001), or could not load any
  }
  return platforms;
}

/// PoCL asks there for processors and memory, and ends the process where it finds none: in a bare chroot.
std::string sysfs_fault() {
  for (const char* folder : {"/sys/devices/system/cpu", "/sys/bus/cpu/devices"}) {
    std::error_code error;
    if (std::filesystem::is_directory(folder, error)) return {};
  }
  return "/sys does not describe the processors; mount it: mount -t sysfs sysfs /sys";
}

/// Why this platform should not be asked for its devices; empty when it may. PoCL looks at its cache first: it ends the
/// process on an entry that is not whole, or when the folder's name is empty, and says nothing when it cannot be made.
std::string fault_of(const cl::Platform& platform) {
  if (!is_pocl(platform.getInfo<CL_PLATFORM_NAME>())) return {};
  std::string fault = sysfs_fault();
  if (fault.empty()) fault = pocl_cache_fault();
  if (fault.empty()) {
    static const int dropped = drop_broken_pocl_entries();  // once: PoCL holds on to what it has loaded
    static_cast<void>(dropped);
  }
  return fault;
}

/// What the library that an .icd file names says to being loaded.
std::string driver_fault(const std::filesystem::path& icd) {
  std::string library;
  std::getline(std::ifstream(icd) >> std::ws, library);
  library = trimmed(library);
  const std::string name = icd.filename().string() + ": ";
  if (library.empty()) return name + "names no library";
  void* loaded = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (loaded == nullptr) return name + ::dlerror();
  ::dlclose(loaded);
  return name + library + " offers no OpenCL platform";
}

/// The loader found nothing where it looks for .icd files (ocl-icd and Khronos' loader: OCL_ICD_VENDORS names another
/// folder).
std::string why_no_platform() {
  namespace fs = std::filesystem;
  const char* named = std::getenv("OCL_ICD_VENDORS");
  const fs::path folder = named != nullptr ? named : "/etc/OpenCL/vendors";
  const std::string where = named != nullptr ? fmt::format("OCL_ICD_VENDORS ({})", named) : folder.string();
  std::error_code error;
  if (!fs::is_directory(folder, error)) return where + " is no folder of drivers";
  std::set<fs::path> files;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".icd") files.insert(entry->path());
  if (files.empty()) return where + " holds no .icd file";
  std::string faults;
  for (const fs::path& file : files) faults += (faults.empty() ? "" : "; ") + driver_fault(file);
  return where + " names no driver that works: " + faults;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found;
  for (const cl::Platform& platform : all_platforms()) {
    std::vector<cl::Device> devices;
    try {
      if (!fault_of(platform).empty()) continue;
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const cl::Error&) {
      continue;  // a platform without devices answers with an error
    }
    for (const cl::Device& device : devices) {
      try {
        if (!usable(device)) continue;
        found.push_back(describe(platform, device));
        found.back().info.index = static_cast<int>(found.size()) - 1;
      } catch (const cl::Error&) {
        continue;  // a device that cannot say what it is cannot be used either
      }
    }
  }
  for (FoundDevice& device : found) pretend(device);
  return found;
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (FoundDevice& device : find_devices()) infos.push_back(std::move(device.info));
  return infos;
}

std::vector<FoundDevice> matching_devices(const std::vector<FoundDevice>& devices, const std::string& selector) {
  int index = -1;
  const char* end = selector.data() + selector.size();
  const auto parsed = std::from_chars(selector.data(), end, index);
  const bool is_index = parsed.ec == std::errc() && parsed.ptr == end &&  // or a part of a name, "4090"
                        std::ranges::find(devices, index, [](const auto& d) { return d.info.index; }) != devices.end();
  std::vector<FoundDevice> matching;
  for (const FoundDevice& device : devices) {
    const std::string names = lower(device.info.platform) + "\n" + lower(device.info.name);
    if (is_index ? device.info.index == index : names.find(lower(selector)) != std::string::npos)
      matching.push_back(device);
  }
  return matching;
}

std::string driver_environment() {
  std::string text;
  for (const auto& [name, value] : environment_with({"CL_CONFIG_", "OCLGRIND_", "POCL_", "RUSTICL_"}))
    if (name != "POCL_CACHE_DIR") text += fmt::format("\n{}={}", name, value);
  return text;
}

std::string describe_devices(const std::vector<FoundDevice>& devices) {
  std::string text;
  for (const FoundDevice& device : devices)
    text += fmt::format("{}{}: {} ({})", text.empty() ? "" : "; ", device.info.index, device.info.name,
                        device.info.platform);
  return text;
}

std::string fingerprint_of(const FoundDevice& device) {
  const DeviceInfo& info = device.info;
  return fmt::format("{} | {} | {} | {} | {} | {} | {} compute units", info.name, info.vendor, info.version,
                     info.driver, info.platform, device.platform_version, info.compute_units);
}

bool is_pocl(const std::string& platform) { return platform.find("Portable Computing Language") != std::string::npos; }

std::string why_no_device() {
  std::string faults;
  for (const cl::Platform& platform : all_platforms()) {
    std::string name = "a platform", fault;
    try {
      name = trimmed(platform.getInfo<CL_PLATFORM_NAME>());
      fault = fault_of(platform);
    } catch (const cl::Error& error) {
      fault = opencl_error_name(error.err());
    }
    faults += fmt::format("; {}: {}", name, fault.empty() ? "no device that can be used" : fault);
  }
  if (!faults.empty()) return "no OpenCL device" + faults;
  return "no OpenCL device: " + why_no_platform() + "; to install a driver, for a CPU: apt install pocl-opencl-icd";
}

std::string opencl_error_name(int code) {
  static const std::pair<int, const char*> names[] = {
      {CL_DEVICE_NOT_FOUND, "CL_DEVICE_NOT_FOUND"},
      {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
      {CL_COMPILER_NOT_AVAILABLE, "CL_COMPILER_NOT_AVAILABLE"},
      {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
      {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
      {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
      {CL_PROFILING_INFO_NOT_AVAILABLE, "CL_PROFILING_INFO_NOT_AVAILABLE"},
      {CL_MEM_COPY_OVERLAP, "CL_MEM_COPY_OVERLAP"},
      {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE"},
      {CL_MAP_FAILURE, "CL_MAP_FAILURE"},
      {CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST, "CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST"},
      {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
      {CL_INVALID_DEVICE, "CL_INVALID_DEVICE"},
      {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
      {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
      {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
      {CL_INVALID_BINARY, "CL_INVALID_BINARY"},
      {CL_INVALID_BUILD_OPTIONS, "CL_INVALID_BUILD_OPTIONS"},
      {CL_INVALID_PROGRAM_EXECUTABLE, "CL_INVALID_PROGRAM_EXECUTABLE"},
      {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME"},
      {CL_INVALID_KERNEL, "CL_INVALID_KERNEL"},
      {CL_INVALID_ARG_INDEX, "CL_INVALID_ARG_INDEX"},
      {CL_INVALID_ARG_VALUE, "CL_INVALID_ARG_VALUE"},
      {CL_INVALID_ARG_SIZE, "CL_INVALID_ARG_SIZE"},
      {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
      {CL_INVALID_WORK_DIMENSION, "CL_INVALID_WORK_DIMENSION"},
      {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
      {CL_INVALID_WORK_ITEM_SIZE, "CL_INVALID_WORK_ITEM_SIZE"},
      {CL_INVALID_GLOBAL_OFFSET, "CL_INVALID_GLOBAL_OFFSET"},
      {CL_INVALID_EVENT_WAIT_LIST, "CL_INVALID_EVENT_WAIT_LIST"},
      {CL_INVALID_OPERATION, "CL_INVALID_OPERATION"},
      {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE"},
      {CL_INVALID_GLOBAL_WORK_SIZE, "CL_INVALID_GLOBAL_WORK_SIZE"},
      {-1001, "CL_PLATFORM_NOT_FOUND_KHR"}};
  for (const auto& [known, name] : names)
    if (known == code) return fmt::format("{} ({})", name, code);
  return fmt::format("OpenCL error {}", code);
}

}  // namespace clerestory
