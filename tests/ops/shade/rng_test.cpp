// Random numbers without state and Owen-scrambled Sobol points (kernels/lib/rng.clh).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "checks/shade/sobol_reference.hpp"
#include "host/math/statistics.hpp"
#include "tests/ops/shade/surface_probe.hpp"
#include "tests/ops/test_device.hpp"

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

// The reference's points before they are scrambled, beside those that Joe and Kuo print (in the order of Gray's code).
TEST(Sobol, ReferenceHasThePublishedPoints) {
  const double published[10][3] = {{0, 0, 0},
                                   {0.5, 0.5, 0.5},
                                   {0.75, 0.25, 0.25},
                                   {0.25, 0.75, 0.75},
                                   {0.375, 0.375, 0.625},
                                   {0.875, 0.875, 0.125},
                                   {0.625, 0.125, 0.875},
                                   {0.125, 0.625, 0.375},
                                   {0.1875, 0.3125, 0.9375},
                                   {0.6875, 0.8125, 0.4375}};
  for (unsigned i = 0; i < 10; ++i)
    for (unsigned d = 0; d < 3; ++d) EXPECT_EQ(sobol_reference(i ^ (i >> 1))[d] * 0x1p-32, published[i][d]) << i << d;
}

TEST(Rng, NumbersAreThoseOfTheHash) {
  for (const auto& [seed, pixel, block] : {std::array{0u, 0u, 0u}, {5u, 12345u, 3u}, {0xdeadbeefu, 0xffffffffu, 1u}}) {
    const Rows rows = points(64, seed, pixel, block);
    for (unsigned i = 0; i < 64; ++i)
      for (std::size_t d = 0; d < 4; ++d) ASSERT_EQ(rows[d][i], hashed(seed, pixel, i, block)[d]) << i << " " << d;
  }
}

TEST(Sobol, NumbersAreThoseOfHashedOwenScrambling) {
  for (const auto& [seed, pixel, block] :
       {std::array{0u, 0u, 0u}, {5u, 12345u, 0u}, {5u, 12345u, 1u}, {0xdeadbeefu, 7u, 2u}}) {
    const Rows rows = points(1 << 14, seed, pixel, block);  // all 15 bits that a picture's samples may have
    for (unsigned i = 0; i < 1u << 14; ++i) {
      const Point4 want = scrambled_sobol_reference(seed, pixel, i, block);
      for (std::size_t d = 0; d < 4; ++d)
        ASSERT_EQ(rows[4 + d][i], unit_of(want[d])) << "sample " << i << ", dimension " << d << ", block " << block;
    }
  }
}

/// How many of the points fall into each of the 2^a x 2^b boxes, in ascending order.
std::vector<int> boxes(const std::vector<double>& x, const std::vector<double>& y, std::size_t count, int a, int b) {
  std::vector<int> filled(std::size_t{1} << (a + b), 0);
  for (std::size_t i = 0; i < count; ++i) {
    const int column = static_cast<int>(std::ldexp(x[i], a)), row = static_cast<int>(std::ldexp(y[i], b));
    filled[static_cast<std::size_t>(row << a | column)]++;
  }
  std::sort(filled.begin(), filled.end());
  return filled;
}

// Of two dimensions with primitive polynomials of degrees e and f Sobol promises a (t, m, 2) net, t = e + f - 2 at most
// (his first dimension counts as e = 1): each box of volume 2^(t - m) holds 2^t of the first 2^m points. The scrambled
// points keep that, and each grid as evenly filled as the points before scrambling do.
TEST(Sobol, EveryPairOfDimensionsIsItsNet) {
  const int degree[4] = {1, 1, 2, 3}, most = 9;
  Rows plain(4);
  for (unsigned i = 0; i < 1u << most; ++i)
    for (std::size_t d = 0; d < 4; ++d) plain[d].push_back(sobol_reference(i)[d] * 0x1p-32);
  for (const auto& [pixel, block] : {std::pair{0u, 0u}, {12345u, 0u}, {7u, 1u}}) {
    const Rows rows = points(1 << most, 5, pixel, block);
    for (std::size_t d = 0; d < 4; ++d)
      for (std::size_t e = d + 1; e < 4; ++e)
        for (int m = 0; m <= most; ++m)
          for (int a = 0; a <= m; ++a) {
            const std::size_t count = std::size_t{1} << m;
            const int t = std::min(m, degree[d] + degree[e] - 2), b = std::max(0, m - t - a);
            if (a <= m - t) {
              ASSERT_EQ(boxes(rows[4 + d], rows[4 + e], count, a, b), std::vector<int>(count >> t, 1 << t))
                  << "dimensions " << d << " and " << e << ", 2^" << m << " points, shape " << a;
            }
            if (block > 0) continue;  // blocks after the first take the points in another order
            ASSERT_EQ(boxes(rows[4 + d], rows[4 + e], count, a, m - a), boxes(plain[d], plain[e], count, a, m - a));
          }
  }
}

// The first point of each pixel is four random numbers of its own: no dimension is scrambled like another, nor like
// another block's, another seed's, or that of the pixel beside or below it.
TEST(Sobol, ScramblesOfPixelsDimensionsBlocksAndSeedsAreIndependent) {
  constexpr std::size_t pixels = 4000, width = 320;
  Probe probe(test_device(), Precision::Single);
  Rows first(12);  // four dimensions; of another block; of another seed
  for (unsigned p = 0; p < pixels; ++p)
    for (const auto& [at, seed, block] : {std::array{0u, 5u, 0u}, {4u, 5u, 1u}, {8u, 6u, 0u}}) {
      const std::vector<double> numbers = probe.run("probe_points", 0, 1, 8, {}, seed, p, block);
      for (std::size_t d = 0; d < 4; ++d) first[at + d].push_back(numbers[4 + d]);
    }
  const double significance = sidak_significance(1e-3, 12 * 11 / 2 + 2 * 12);
  for (std::size_t a = 0; a < first.size(); ++a) {
    for (std::size_t b = a + 1; b < first.size(); ++b)
      EXPECT_GT(uniformity(first[a], first[b], 8), significance) << a << " and " << b;
    for (const std::size_t step : {std::size_t{1}, width}) {
      const std::vector<double> here(first[a].begin(), first[a].end() - static_cast<long>(step)),
          there(first[a].begin() + static_cast<long>(step), first[a].end());
      EXPECT_GT(uniformity(here, there, 8), significance) << a << ", pixels " << step << " apart";
    }
  }
}

}  // namespace
}  // namespace clerestory
