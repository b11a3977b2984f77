#include "host/cl/profiler.hpp"

#include <CL/cl.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "host/cl/platforms.hpp"

namespace clerestory {
namespace {

// An event costs the driver memory, so that a long run must not let them pile up.
constexpr std::size_t most_pending = 4096;

void check(cl_int code, const char* call, const std::string& kernel) {
  if (code != CL_SUCCESS)
    throw Error(ErrorKind::Device,
                fmt::format("{} failed with {} for kernel {}", call, opencl_error_name(code), kernel));
}

}  // namespace

void Profiler::add(const std::string& name, cl_event event) {
  pending_.emplace_back(&name, event);
  if (pending_.size() >= most_pending) collect();
}

void Profiler::collect() {
  if (pending_.empty()) return;
  check(clWaitForEvents(1, &pending_.back().second), "clWaitForEvents",
        *pending_.back().first);  // the queue is in order
  const auto done = std::exchange(pending_, {});
  const auto release = [](const auto* events) {
    for (const auto& [name, event] : *events) clReleaseEvent(event);
  };
  const std::unique_ptr<const decltype(pending_), decltype(release)> released(&done, release);  // whatever comes
  for (const auto& [name, event] : done) {
    cl_ulong start = 0, end = 0;
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, nullptr),
          "clGetEventProfilingInfo", *name);
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, nullptr),
          "clGetEventProfilingInfo", *name);
    KernelProfile& sum = sums_[*name];
    sum.kernel = *name;
    ++sum.launches;
    sum.seconds += static_cast<double>(end - start) * 1e-9;
  }
}

std::vector<KernelProfile> Profiler::profile() {
  collect();
  std::vector<KernelProfile> result;
  for (const auto& [name, sum] : sums_) result.push_back(sum);
  std::ranges::stable_sort(result, std::greater{}, &KernelProfile::seconds);
  return result;
}

void Profiler::reset() {
  for (const auto& [name, event] : pending_) clReleaseEvent(event);
  pending_.clear();
  sums_.clear();
}

}  // namespace clerestory
