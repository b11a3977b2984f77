// Random numbers without state and Owen-scrambled Sobol points (kernels/lib/rng.clh).
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "host/math/statistics.hpp"
#include "tests/ops/op_check.hpp"
#include "tests/ops/shade/surface_probe.hpp"

namespace clerestory {
namespace {

using Rows = std::vector<std::vector<double>>;  // 0-3 independent, 4-7 Sobol

Rows points(int count, unsigned seed, unsigned pixel, unsigned block = 0, Precision precision = Precision::Single) {
  Probe probe(test_device(precision), precision);
  const std::vector<double> all = probe.run("probe_points", 0, count, 8, {}, seed, pixel, block);
  Rows rows;
  for (int r = 0; r < 8; ++r) rows.emplace_back(all.begin() + r * count, all.begin() + (r + 1) * count);
  return rows;
}

double uniformity(const std::vector<double>& a, const std::vector<double>& b, int cells) {
  std::vector<double> observed(static_cast<std::size_t>(cells * cells), 0);
  const std::vector<double> expected(observed.size(),
                                     static_cast<double>(a.size()) / static_cast<double>(observed.size()));
  for (std::size_t i = 0; i < a.size(); ++i)
    observed[static_cast<std::size_t>(static_cast<int>(a[i] * cells) * cells + static_cast<int>(b[i] * cells))] += 1;
  return chi_square_test(observed, expected).p_value;
}

TEST(Rng, IsUniformInPairsOfDimensionsAndNeighbours) {
  const int count = 1 << 16;
  const double significance = sidak_significance(1e-3, 3 * 10);
  for (const unsigned seed : {0u, 1u, 0xdeadbeefu}) {
    const Rows rows = points(count, seed, 0);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = a + 1; b < 4; ++b) EXPECT_GT(uniformity(rows[a], rows[b], 16), significance) << a << b;
      std::vector<double> next(rows[a].begin() + 1, rows[a].end());
      next.push_back(rows[a].front());
      EXPECT_GT(uniformity(rows[a], next, 16), significance) << a << " against the next sample";
    }
  }
}

TEST(Rng, KeysDecorrelate) {
  const int count = 1 << 16;
  const double significance = sidak_significance(1e-3, 4 * 3);
  const Rows here = points(count, 1, 0), pixel = points(count, 1, 1), seed = points(count, 2, 0),
             block = points(count, 1, 0, 1);
  for (std::size_t a = 0; a < 4; ++a) {
    EXPECT_GT(uniformity(here[a], pixel[a], 16), significance);
    EXPECT_GT(uniformity(here[a], seed[a], 16), significance);
    EXPECT_GT(uniformity(here[a], block[a], 16), significance);
  }
}

TEST(Rng, AreTheSameNumbersInBothPrecisions) { EXPECT_EQ(points(512, 3, 9), points(512, 3, 9, 0, Precision::Double)); }

TEST(Rng, StaysInTheUnitInterval) {
  for (const std::vector<double>& row : points(1 << 16, 7, 3))
    for (const double u : row) ASSERT_TRUE(u >= 0 && u < 1);
}

// A (0, m, 2) net: each of the 2^m boxes of every shape 2^-a x 2^-(m-a) holds exactly one of the first 2^m points.
TEST(Sobol, FillsElementaryIntervals) {
  for (const unsigned pixel : {0u, 1u, 12345u})
    for (const unsigned block : {0u, 1u})
      for (int m = 0; m <= 10; ++m) {
        const int count = 1 << m;
        const Rows rows = points(count, 5, pixel, block);
        for (int a = 0; a <= m; ++a) {
          std::set<int> boxes;
          for (int i = 0; i < count; ++i) {
            const int x = static_cast<int>(rows[4][static_cast<std::size_t>(i)] * (1 << a));
            const int y = static_cast<int>(rows[5][static_cast<std::size_t>(i)] * (1 << (m - a)));
            boxes.insert(x << (m - a) | y);
          }
          ASSERT_EQ(boxes.size(), static_cast<std::size_t>(count))
              << "2^" << m << " points, shape " << a << ", block " << block;
        }
        for (std::size_t d = 4; d < 8; ++d) {  // every dimension alone
          std::set<int> strata;
          for (const double u : rows[d]) strata.insert(static_cast<int>(u * count));
          ASSERT_EQ(strata.size(), static_cast<std::size_t>(count)) << "dimension " << d - 4;
        }
      }
}

TEST(Sobol, ScramblesDifferFromPixelToPixelAndAreUniform) {
  // The first point of each pixel is a random number of its own.
  const int pixels = 2000;
  Probe probe(test_device(), Precision::Single);
  std::vector<double> x, y;
  for (int p = 0; p < pixels; ++p) {
    const std::vector<double> first = probe.run("probe_points", 0, 1, 8, {}, 5u, static_cast<unsigned>(p), 0u);
    x.push_back(first[4]), y.push_back(first[5]);
  }
  EXPECT_GT(uniformity(x, y, 8), 1e-3);
}

}  // namespace
}  // namespace clerestory
