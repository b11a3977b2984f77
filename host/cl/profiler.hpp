// Event times of launches, summed by name. Private to host/cl.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "host/cl/device.hpp"

typedef struct _cl_event* cl_event;

namespace clerestory {

class Profiler {
 public:
  Profiler() = default;
  Profiler(const Profiler&) = delete;
  Profiler& operator=(const Profiler&) = delete;
  ~Profiler() { reset(); }

  /// Takes the event over. `name` must live as long as the profiler.
  void add(const std::string& name, cl_event event);
  /// Sums by name, slowest first. Waits for the events.
  std::vector<KernelProfile> profile();
  void reset();

 private:
  void collect();

  std::vector<std::pair<const std::string*, cl_event>> pending_;
  std::map<std::string, KernelProfile> sums_;
};

}  // namespace clerestory
