// Kernels as programs launch them: which variants there are, and which have been launched.
#pragma once
#include <set>
#include <string>

#include "host/cl/device.hpp"

namespace clerestory {

/// A kernel and what its program was built with. Its float and its double form are one variant.
struct KernelVariant {
  std::string file, name;  // "nn/conv_cpu.cl", "conv_cpu"
  Defines defines;
  auto operator<=>(const KernelVariant&) const = default;
};
/// Without GROUP_RAYS, which follows from how much local memory a device has: each would add its own to the list.
KernelVariant variant_of(std::string_view file, std::string_view name, Defines defines);
/// "nn/conv_cpu.cl:conv_cpu TILE_ROWS=8 TILE_WIDTH=16", as checks/variants.txt lists them.
std::string text_of(const KernelVariant& variant);

/// Variants that this process has launched in that precision, on any device, since the last forget_launched(). Where
/// the environment variable CLERESTORY_LAUNCHES names a file, it gets a line at each first launch since then.
std::set<KernelVariant> launched_variants(Precision precision);
void forget_launched();

}  // namespace clerestory
