#include "host/cl/profiler.hpp"

#include <CL/cl.h>

#include <algorithm>

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
  std::vector<double> seconds;    // of all, or of none: a device may fail to say
  for (const auto& [name, event] : pending_) {
    cl_ulong start = 0, end = 0;
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, nullptr),
          "clGetEventProfilingInfo", *name);
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, nullptr),
          "clGetEventProfilingInfo", *name);
    seconds.push_back(static_cast<double>(end - start) * 1e-9);
  }
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    const std::string& name = *pending_[i].first;
    KernelProfile& sum = sums_[name];
    sum.kernel = name, ++sum.launches, sum.seconds += seconds[i];
    clReleaseEvent(pending_[i].second);
  }
  pending_.clear();
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
