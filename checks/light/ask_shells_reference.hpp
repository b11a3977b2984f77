// Painted spheres in one kernel: inputs, and how far rounding may take the answers.
#pragma once
#include "checks/light/shell_reference.hpp"
#include "checks/op_case.hpp"
#include "host/ops/light/ask_shells.hpp"

namespace clerestory::ask_shells_reference {

/// `reach`: how far rays start from the camera, in scales; density from 0 to `dense`, the outermost opaque.
inline Tensors shell_inputs(int rows, int samples, double reach, double dense, const Shape& map,
                            bool point_per_row = false) {
  Tensors t{{"shells", random_tensor({3, 4, map.h, map.w}, 1, 0, 2)},
            {"points", random_tensor({1, 3, rows, point_per_row ? 1 : samples}, 2, -2 * reach, 2 * reach)},
            {"direction", random_tensor({1, 3, rows, samples}, 3)},
            {"range", Tensor({1, 3, 1, 1}, std::vector<double>{2, 1, 2})}};
  for (int k = 0; k < 3; ++k)
    for (int y = 0; y < map.h; ++y)
      for (int x = 0; x < map.w; ++x) {
        double& density = t["shells"].at(k, 3, y, x);
        density = k == 2 ? 1000 : 0.5 * dense * density;
      }
  return t;
}

inline Value ask(const Values& v, const RayList& list) {
  return ask_shells(v.at("shells"), v.at("points"), v.at("direction"), v.at("range"), list, kShellRadii);
}

/// A place on the map is off by a few units in the last place of the start's distance, times the columns: so is a
/// colour, and the light by as much for each sphere's colour and density.
inline double roundings_of(double reach, const Shape& map) { return 6 * 64.0 * map.w * (1 + reach); }

}  // namespace clerestory::ask_shells_reference
