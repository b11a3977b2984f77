// Memory that this process holds, as the system counts it; zeros where it does not say (/proc of Linux).
#pragma once
#include <cstddef>
#include <fstream>
#include <string>

namespace clerestory {

struct ProcessMemory {
  std::size_t now = 0, peak = 0;  // bytes resident: now, and the most since it began or since forget_peak()
};

inline ProcessMemory process_memory() {
  ProcessMemory memory;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) memory.now = std::stoul(line.substr(6)) * 1024;
    if (line.starts_with("VmHWM:")) memory.peak = std::stoul(line.substr(6)) * 1024;
  }
  return memory;
}

/// From now on peaks count from here.
inline void forget_peak() { std::ofstream("/proc/self/clear_refs") << "5\n"; }

}  // namespace clerestory
