#include "host/cl/reproducer.hpp"

#include <CL/opencl.hpp>

#include "host/cl/platforms.hpp"

namespace clerestory {
namespace {

constexpr cl_int kMany = 70001;
constexpr std::size_t kItems = 16;

cl_int run(const std::string& source, const cl::Device& device) {
  const cl::Context context(device);
  const cl::CommandQueue queue(context, device);
  cl::Program program(context, source);
  program.build({device}, "-cl-std=CL1.2 -w");
  std::vector<cl_int> wrong(kItems, 0);
  const std::size_t bytes = wrong.size() * sizeof wrong[0];
  const cl::Buffer buffer(context, CL_MEM_READ_WRITE, bytes);
  queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, wrong.data());
  cl::Kernel kernel(program, "reproduce");
  kernel.setArg(0, buffer), kernel.setArg(1, kMany);
  queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(kItems), cl::NDRange(kItems));
  queue.enqueueReadBuffer(buffer, CL_TRUE, 0, bytes, wrong.data());
  return wrong[0];
}

}  // namespace

std::vector<std::string> device_fingerprints() {
  std::vector<std::string> all;
  for (const FoundDevice& device : find_devices()) all.push_back(fingerprint_of(device));
  return all;
}

std::string shown_by(const std::string& source, int index) {
  for (const FoundDevice& found : find_devices()) {
    if (found.info.index != index) continue;
    try {
      const cl_int wrong = run(source, cl::Device(found.id, true));
      return wrong == 0 ? "" : std::to_string(wrong);
    } catch (const cl::BuildError& error) {
      std::string log;
      for (const auto& [device, text] : error.getBuildLog()) log += text;
      return opencl_error_name(error.err()) + ": " + log;
    } catch (const cl::Error& error) {
      return fmt::format("{} failed with {}", error.what(), opencl_error_name(error.err()));
    }
  }
  throw Error(ErrorKind::Device, "no such OpenCL device", "index", std::to_string(index));
}

}  // namespace clerestory
