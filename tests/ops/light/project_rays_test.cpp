// Directions projected into a picture.
#include "host/ops/light/project_rays.hpp"

#include <gtest/gtest.h>

#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

constexpr Shape kPicture{1, 1, 12, 20};

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
