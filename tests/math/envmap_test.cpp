// Environment maps' layout and directions: cells, uniformity by solid angle, the generator's known numbers.
#include "host/math/envmap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <vector>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
// A few roundings of cosines near 1, in a cell that is 0.019 of them high at the least.
constexpr double kOfCell = 8 * eps / 0.019;

TEST(Envmap, LayoutHasFortyTilesAlongTheLongerSide) {
  struct Case {
    int width, height, columns, rows;
  };
  for (const Case& c :
       {Case{160, 120, 40, 30}, Case{640, 480, 40, 30}, Case{120, 160, 30, 40}, Case{1920, 1080, 40, 23},
        Case{20, 16, 40, 32}, Case{4096, 16, 40, 1}, Case{100, 100, 40, 40}}) {
    const EnvmapLayout layout = EnvmapLayout::of(c.width, c.height);
    EXPECT_EQ(layout.columns, c.columns) << c.width << "x" << c.height;
    EXPECT_EQ(layout.rows, c.rows) << c.width << "x" << c.height;
    EXPECT_EQ(layout.file_width(), 16 * c.columns);
    EXPECT_EQ(layout.file_height(), 8 * c.rows);
    for (int column = 0; column < layout.columns; ++column) {
      const double center = (column + 0.5) * c.width / c.columns;
      EXPECT_LE(layout.pixel_x(column), center);
      EXPECT_GT(layout.pixel_x(column) + 1, center);
    }
    for (int row = 0; row < layout.rows; ++row) {
      const double center = (row + 0.5) * c.height / c.rows;
      EXPECT_LE(layout.pixel_y(row), center);
      EXPECT_GT(layout.pixel_y(row) + 1, center);
    }
  }
  EXPECT_THROW(EnvmapLayout::of(0, 10), Error);
}

/// Where a texel's direction lies inside its cell: shares of the way in azimuth and in the cosine of the elevation.
struct Place {
  double azimuth, cosine;
};

Place place_in_cell(const Vec3& d, int azimuth, int elevation) {
  const double first = std::cos(elevation * glm::pi<double>() / 16),
               last = std::cos((elevation + 1) * glm::pi<double>() / 16);
  const double turn = std::atan2(d.y, d.x) / glm::two_pi<double>() + 0.5;
  return {turn * 16 - azimuth, (d.z - first) / (last - first)};
}

TEST(Envmap, DirectionsFillTheirCellsEvenly) {
  std::vector<double> azimuths(16, 0), cosines(16, 0), joint(64, 0);
  double cosine_sum = 0;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column)
      for (int elevation = 0; elevation < 8; ++elevation)
        for (int azimuth = 0; azimuth < 16; ++azimuth) {
          const Vec3 d = envmap_direction(column, row, azimuth, elevation);
          ASSERT_NEAR(glm::length(d), 1, 4 * eps);
          ASSERT_GT(d.z, 0);
          const Place p = place_in_cell(d, azimuth, elevation);
          // In the cell but for rounding: near the normal cosines differ by 2e-2 from edge to edge.
          ASSERT_GT(p.azimuth, -kOfCell);
          ASSERT_LT(p.azimuth, 1 + kOfCell);
          ASSERT_GT(p.cosine, -kOfCell);
          ASSERT_LT(p.cosine, 1 + kOfCell);
          const auto bin = [](double share, int bins) {
            return static_cast<std::size_t>(std::min(share, 1 - 1e-12) * bins);
          };
          ++azimuths[bin(std::max(0.0, p.azimuth), 16)], ++cosines[bin(std::max(0.0, p.cosine), 16)];
          ++joint[8 * bin(std::max(0.0, p.azimuth), 8) + bin(std::max(0.0, p.cosine), 8)];
          cosine_sum += d.z * envmap_solid_angle(elevation);
        }
  const double texels = 1200 * 128;
  for (const std::vector<double>& counts : {azimuths, cosines, joint}) {
    const std::vector<double> expected(counts.size(), texels / static_cast<double>(counts.size()));
    EXPECT_GT(chi_square_test(counts, expected).p_value, 1e-3);
  }
  // The cosine's integral over the hemisphere is pi. In a cell it spreads by at most 0.2 / sqrt(12), its solid angle is
  // at most 0.077: 153600 such terms over 1200 tiles.
  EXPECT_NEAR(cosine_sum / 1200, glm::pi<double>(), 4.5 * 0.077 * 0.2 / std::sqrt(12.0) * std::sqrt(texels) / 1200);
}

TEST(Envmap, NumbersAreSplitMixes) {
  // The first two numbers of SplitMix64 begun at 0 are e220a8397b1dcdaf and 6e789e6aa1b965f4.
  struct Case {
    int azimuth;
    double u, v;
  };
  for (const Case& c : {Case{0, 0xe220a8 + 0.5, 0x397b1d + 0.5}, Case{1, 0x6e789e + 0.5, 0x6aa1b9 + 0.5}}) {
    const Place p = place_in_cell(envmap_direction(0, 0, c.azimuth, 0), c.azimuth, 0);
    EXPECT_NEAR(p.cosine, c.u * 0x1p-24, kOfCell);
    EXPECT_NEAR(p.azimuth, c.v * 0x1p-24, kOfCell);
  }
}

TEST(Envmap, CameraSpaceIsLisFrame) {
  // z = n, y = norm(up - (up.n) n), x = -norm(y cross n), written out; up = (0,0,1) beyond 0.999.
  for (const Vec3& n : {glm::normalize(Vec3(0.3, 0.2, 0.9)), Vec3(-1, 0, 0), glm::normalize(Vec3(0.02, 1, 0.03)),
                        glm::normalize(Vec3(0.06, -1, 0)), Vec3(0, 1, 0)}) {
    const Vec3 up = std::abs(n.y) > 0.999 ? Vec3(0, 0, 1) : Vec3(0, 1, 0);
    Vec3 y = up - (up.x * n.x + up.y * n.y + up.z * n.z) * n;
    y /= std::sqrt(y.x * y.x + y.y * y.y + y.z * y.z);
    const Vec3 x = -Vec3(y.y * n.z - y.z * n.y, y.z * n.x - y.x * n.z, y.x * n.y - y.y * n.x);
    for (const int elevation : {0, 4, 7})
      for (int azimuth = 0; azimuth < 16; ++azimuth) {
        const Vec3 l = envmap_direction(7, 21, azimuth, elevation);
        const Vec3 d = envmap_direction(hemisphere_frame(n), 7, 21, azimuth, elevation);
        // The subtraction loses up to 1 / sin(angle of 0.999) = 23 of the digits.
        EXPECT_NEAR(glm::length(d - (l.x * x + l.y * y + l.z * n)), 0, 16 * 23 * eps);
        EXPECT_GT(glm::dot(d, n), 0);
      }
  }
  EXPECT_GT(std::abs(glm::normalize(Vec3(0.02, 1, 0.03)).y), 0.999) << "both branches are visited";
  EXPECT_LT(std::abs(glm::normalize(Vec3(0.06, -1, 0)).y), 0.999);
}

TEST(Envmap, SolidAnglesFillTheHemisphere) {
  double sum = 0;
  for (int elevation = 0; elevation < 8; ++elevation) {
    sum += 16 * envmap_solid_angle(elevation);
    // Li et al. take the sine at the cell's middle for the mean over the cell, which is sin(h) / h of it, h = pi / 32.
    // The difference of two cosines, times a sixteenth of a turn, 0.4.
    const double half = glm::pi<double>() / 32;
    EXPECT_NEAR(envmap_solid_angle(elevation), hemisphere_weight(elevation) * std::sin(half) / half, 2 * eps);
  }
  EXPECT_NEAR(sum, glm::two_pi<double>(), 128 * 2 * eps);
}

}  // namespace
}  // namespace clerestory
