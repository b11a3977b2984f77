// `clerestory check --device all`: which kernels are right on every device, how exactly, and what is known of failures.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/commands/cli.hpp"

namespace clerestory {

struct DevicesOptions {
  std::vector<std::string> only;  // stems to check
  bool all = true;                // these are all there are
  bool quick = false;             // the smallest case of each kernel
  bool again = false;             // without a look at kept verdicts
  double patience = 15;           // minutes without a launch after which a driver counts as one that hangs
  std::vector<std::string> from;  // files that --json wrote
  std::filesystem::path report;   // .html or .md; empty: none
};

/// Each device in a process of its own: drivers crash, and two compilers in one process may be one too many. Prints a
/// table and "kernels K devices D failed F unexplained U": K variants were run on D devices; F pairs of variant and
/// device failed, and devices that are refused or lost; U of them without a reproducer in checks/reproducers that shows
/// its fault there. Throws ErrorKind::Failed when a device that programs would use fails, or all are refused.
void check_devices(const DevicesOptions& options, const CommonOptions& common);
/// The same from files. What several of them say of one device, each of some ops, is one verdict.
void show_devices(const DevicesOptions& options, const CommonOptions& common);

/// shown_by() a file on the device of that index. Throws ErrorKind::Failed when it shows its fault.
void reproduce_fault(const std::filesystem::path& file, const CommonOptions& common);

}  // namespace clerestory
