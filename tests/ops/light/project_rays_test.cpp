// Directions projected into a picture.
#include "host/ops/light/project_rays.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ops/op_check.hpp"

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

TEST(ProjectRays, EdgesBelongToThePicture) {
  Graph g;
  // Straight ahead; the upper left corner exactly; the right border itself; backwards, also hardly; nowhere.
  Tensor direction(Shape{1, 3, 1, 16});
  const double rays[6][3] = {{0, 0, -1}, {-9, 6.5, -1}, {11, 0, -1}, {0, 0, 1}, {0.01, 0.01, 0.02}, {0, 0, 0}};
  for (int s = 0; s < 6; ++s)
    for (int c = 0; c < 3; ++c) direction.at(0, c, 0, s) = rays[s][c];
  const Value hit = project_rays(g.constant(direction),
                                 g.constant(Tensor({1, 4, 1, 1}, std::vector<double>{1, 1, 9, 6.5})), kPicture);
  const Tensor found = evaluate(g, {hit}, test_device(), {})[0];
  EXPECT_EQ(found.integer[0], 6 * 20 + 9);
  EXPECT_EQ(found.integer[1], 0);
  EXPECT_EQ(found.integer[2], -1);
  for (const std::size_t s : {3u, 4u, 5u}) EXPECT_EQ(found.integer[s], -1);
}

}  // namespace
}  // namespace clerestory
