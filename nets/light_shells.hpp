// Out-of-view light as painted spheres (beyond the paper): what the photograph's features say, laid out as a panorama,
// is completed by convolutions. No volume is marched, so a ray costs a few look-ups.
#pragma once
#include <vector>

#include "nets/builder.hpp"

namespace clerestory {

struct ShellsSize {
  int count = 4;
  double first = 0.25, last = 3;                   // radii in units of the scene's scale, geometric in between
  int rows = 32, columns = 64;                     // of each sphere's panorama; multiples of 8, columns of 16
  std::vector<int> channels = {64, 96, 128, 192};  // of the completing net, the finest first; multiples of 16
  int code = 128;                                  // numbers that carry what is far apart on the sphere
};

std::vector<double> shell_radii(const ShellsSize& size);

/// `levels`: features of photographs `image` {n, 3, h, w} as resnet() gives them, of which the last two are read;
/// `cameras` {n, 4, 1, 1}. A value {count, 4, rows, columns} for each: radiance, as a multiple of the photograph's
/// geometric mean, and density, the outermost opaque.
std::vector<Value> light_shells(const Scope& scope, const std::vector<Value>& levels, Value image, Value cameras,
                                const ShellsSize& size);

/// Radiance {1, 3, pixels, samples} at points along directions (camera metres, camera frame). With gradients.
Value shells_light(Value shells, Value points, Value direction, Value range, const ShellsSize& size);

}  // namespace clerestory
