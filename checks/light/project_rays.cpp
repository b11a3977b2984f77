// Directions projected into a picture.
#include "host/ops/light/project_rays.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr Shape kPicture{1, 1, 12, 20};

OP_CASES(project_rays) {
  OpCase c{.stem = "project_rays", .label = "around", .kernels = {"project_rays"}};
  // In the picture, beyond each border, behind the camera.
  c.inputs = {{"direction", random_tensor({1, 3, 16, 32}, 1)},
              {"camera", Tensor({1, 4, 1, 1}, std::vector<double>{14, 13, 9, 6.5})}};
  c.build = [](Graph&, const Values& v) {
    return std::vector{project_rays(v.at("direction"), v.at("camera"), kPicture)};
  };
  c.reference = [](const Tensors& t) {
    Tensor y = Tensor::of_int({1, 1, 16, 32}, std::vector<int>(16 * 32, -1));
    for (int p = 0; p < 16; ++p)
      for (int s = 0; s < 32; ++s) {
        const auto d = [&](int i) { return t.at("direction").at(0, i, p, s); };
        if (d(2) >= 0) continue;
        const double column = std::floor(9 + 14 * d(0) / -d(2)), row = std::floor(6.5 - 13 * d(1) / -d(2));
        if (column >= 0 && column < kPicture.w && row >= 0 && row < kPicture.h)
          y.integer[static_cast<std::size_t>(p * 32 + s)] =
              static_cast<int>(row) * kPicture.w + static_cast<int>(column);
      }
    return std::vector{y};
  };
  c.no_gradient = "pixels are discrete";
  return {c};
}

}  // namespace
}  // namespace clerestory
