// Single roundings, in which tolerances are counted: relative, half a unit in the last place of 1.
#pragma once

namespace clerestory {

constexpr double kFloatRounding = 0x1p-24, kDoubleRounding = 0x1p-53;

}  // namespace clerestory
