// Checks a case of an op on a device. What is wrong comes back in words, how exact it is in numbers.
#pragma once
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "checks/op_case.hpp"
#include "host/cl/kernel_variant.hpp"

namespace clerestory {

/// The device whose kernels are checked, and one with doubles that runs their twins: the same, another, or none.
struct CheckedDevices {
  Device single;
  std::optional<Device> with_doubles;

  bool twins_run_elsewhere() const;
};
/// The twins run on the device itself if it has doubles, else on the first that does.
CheckedDevices checked_devices(const Device& device);

/// The bodies of kernels that a case runs on any device: those that suit it, those that GPUs run (16 work-items share a
/// row, kernels/lib/lanes.clh; cases have rows shorter and longer than that), and all register tiles of CPUs
/// (kernels/lib/tile.clh), and those that multiply by CLBlast in place of one kernel.
enum class Bodies { OfDevice, InGroups, InTiles, ByProducts };
/// Those that the kernels of the case have.
std::vector<Bodies> bodies_of(const OpCase& op_case);
/// False where they need groups of more work-items, or more memory in one piece or of a group, than the device has.
bool can_run(const Device& device, const OpCase& op_case, Bodies bodies);
/// False where its kernels need more local memory than the device has: others stand in for them.
bool has_local_memory_for(const Device& device, const OpCase& op_case, Precision precision);

struct OpFindings {
  std::vector<std::string> faults;  // each names the case
  /// The worst error as a share of what the case allows, NaN where nothing was compared: of float against the
  /// reference, of float against double, of the gradient in double against central differences.
  double value_error = NAN, twin_error = NAN, gradient_error = NAN;
  /// The worst error of float in epsilons of the largest magnitude that is compared: of values against the reference
  /// and the twin, of gradients against the twin's.
  double value_ulps = NAN, gradient_ulps = NAN;
  std::set<KernelVariant> launched, launched_in_double;
  /// Names of kernels of the case that faults may come from: those of the backward pass alone where values are right.
  std::set<std::string> suspects;

  void add(const OpFindings& other);
};

/// Bodies of the device, in groups, and by products:
///  - float and double plans against the reference, and float against double;
///  - the adjoint with random cotangents against central differences in double;
///  - two runs, and runs with every pass of compile() off: equal bits;
///  - inputs, outputs and gradients as channel slices of bigger tensors: equal bits, and nothing written beside them;
///  - ops of tensors and nets: a NaN in an input makes every output NaN that a number in its place would change.
/// In tiles: every tile gives the bits of the device's own and writes nothing beside them.
/// Without a device with doubles all that needs double is left out. An error of the device or of the graph is a fault.
OpFindings check_op(const OpCase& op_case, const CheckedDevices& devices, Bodies bodies = Bodies::OfDevice);

/// While it lives, launches are remembered for `findings`, which get them at its end.
class LaunchesSeen {
 public:
  explicit LaunchesSeen(OpFindings& findings) : findings_(findings) { forget_launched(); }
  ~LaunchesSeen();
  LaunchesSeen(const LaunchesSeen&) = delete;
  LaunchesSeen& operator=(const LaunchesSeen&) = delete;

 private:
  OpFindings& findings_;
};

/// The greater of two errors of which either may be missing (NaN).
double worse(double a, double b);

}  // namespace clerestory
