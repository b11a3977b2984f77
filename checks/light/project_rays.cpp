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
  OpCase mirrored = c;
  mirrored.label = "mirrored", mirrored.kernels = {"mirrored_rays"};
  mirrored.inputs["direction"].at(0, 0, 0, 0) = mirrored.inputs["direction"].at(0, 2, 0, 0) = 0;  // straight up
  mirrored.inputs["camera"] = Tensor({1, 4, 1, 1}, std::vector<double>{14, 13, 9.25, 6.5});
  mirrored.build = [](Graph&, const Values& v) {
    return std::vector{mirrored_rays(v.at("direction"), v.at("camera"), kPicture)};
  };
  mirrored.reference = [](const Tensors& t) {
    Tensor y = Tensor::of_int({1, 1, 16, 32}, std::vector<int>(16 * 32, -1));
    // By reflections at one border after the other.
    const auto folded = [](double x, double low, double high) {
      while (x < low || x > high) x = x < low ? 2 * low - x : 2 * high - x;
      return x;
    };
    for (int p = 0; p < 16; ++p)
      for (int s = 0; s < 32; ++s) {
        const auto d = [&](int i) { return t.at("direction").at(0, i, p, s); };
        const double azimuth = std::hypot(d(0), d(2)) > 0 ? std::atan2(d(0), -d(2)) : 0;  // straight up has none
        const double turn = folded(azimuth, std::atan(-9.25 / 14), std::atan(10.75 / 14));
        const double rise =
            folded(std::atan(d(1) / (std::hypot(d(0), d(2)) * std::cos(turn))), std::atan(-5.5 / 13), std::atan(0.5));
        y.integer[static_cast<std::size_t>(p * 32 + s)] =
            static_cast<int>(6.5 - 13 * std::tan(rise)) * kPicture.w + static_cast<int>(9.25 + 14 * std::tan(turn));
      }
    return std::vector{y};
  };
  return {c, mirrored};
}

}  // namespace
}  // namespace clerestory
