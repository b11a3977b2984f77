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

// A picture from -45 to 45 degrees: a quarter turn further it comes back from its border, half a turn further it is
// there again.
TEST(MirroredRays, GoOnBeyondTheBorders) {
  Graph g;
  constexpr Shape square{1, 1, 13, 21};
  Tensor direction(Shape{1, 3, 1, 16});
  const double a = 0.25,
               rays[7][3] = {{a, 0, -1}, {1, 0, -a}, {-1, 0, -a}, {-a, 0, 1}, {0, a, -1}, {0, 1, -a}, {0, 0, 0}};
  for (int s = 0; s < 7; ++s)
    for (int c = 0; c < 3; ++c) direction.at(0, c, 0, s) = rays[s][c];
  const Value hit = mirrored_rays(g.constant(direction),
                                  g.constant(Tensor({1, 4, 1, 1}, std::vector<double>{10.5, 6.5, 10.5, 6.5})), square);
  const Tensor found = evaluate(g, {hit}, test_device(), {})[0];
  const int middle = 6 * 21, right = middle + 13, left = middle + 7, up = 4 * 21 + 10;
  EXPECT_EQ(found.integer[0], right);
  EXPECT_EQ(found.integer[1], right) << "as far beyond the border as it was before it";
  EXPECT_EQ(found.integer[2], left);
  EXPECT_EQ(found.integer[3], right) << "half a turn from the right";
  EXPECT_EQ(found.integer[4], up);
  EXPECT_EQ(found.integer[5], up);
  EXPECT_EQ(found.integer[6], -1);
}

}  // namespace
}  // namespace clerestory
