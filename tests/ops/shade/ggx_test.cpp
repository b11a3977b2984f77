// The surface model and its samplers (kernels/lib/ggx.clh): do samplers draw from the density they state, are weights
// f cos / pdf, what is lost in float, and does the model keep to what physics and its formulas promise.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "checks/shade/surface_reference.hpp"
#include "host/math/statistics.hpp"
#include "tests/ops/shade/surface_probe.hpp"
#include "tests/ops/test_device.hpp"
#include "tests/worst.hpp"

namespace clerestory {
namespace {

constexpr int kCosine = 4, kUniform = 5, kNdfRoughness = 7;

constexpr int kSamplers[] = {0, 1, 2, 3, kCosine, kUniform, kNdfRoughness};

bool is_lobe(int sampler) { return sampler != kCosine && sampler != kUniform; }

constexpr double kViews[] = {0.9999, 0.6, 0.08};

constexpr double kRoughness[] = {0.01, 0.1, 0.3, 0.6, 1.0};  // 0.01: alpha at its floor

struct Samples {
  std::vector<Vec3> wi, weight;
  std::vector<double> pdf;
  double lobe = 0;
};

Samples draw(Probe& probe, int sampler, const SurfaceReference& surface, const Vec3& wo, int count, unsigned seed,
             double lobe) {
  const std::vector<double> rows =
      probe.run("probe_sample", sampler, count, 8, {probe.upload(surface.values()), probe.upload({wo.x, wo.y, wo.z})},
                seed, probe.real(lobe));
  Samples s;
  const std::size_t n = static_cast<std::size_t>(count);
  for (std::size_t i = 0; i < n; ++i) {
    s.wi.emplace_back(rows[i], rows[n + i], rows[2 * n + i]);
    s.weight.emplace_back(rows[3 * n + i], rows[4 * n + i], rows[5 * n + i]);
    s.pdf.push_back(rows[6 * n + i]);
  }
  s.lobe = rows[7 * n];
  return s;
}

/// A direction as the device has it: float numbers of length one to rounding. Through volatile: GCC 12 at -O3 drops the
/// conversions of two neighbours to float and back.
Vec3 as_float(const Vec3& v) {
  volatile float x = static_cast<float>(v.x), y = static_cast<float>(v.y), z = static_cast<float>(v.z);
  return {x, y, z};
}

constexpr int kU = 12, kTurn = 16, kFine = 64;

/// Share of a specular sampler's directions in each cell of the chart, by its stated density. The last is what the
/// others leave: directions below the surface and the outermost ring of normals, where the two meet.
std::vector<double> expected_in_lobe(int sampler, const SurfaceReference& s, const Vec3& wo) {
  const LobeChart chart{s.alpha()};
  std::vector<double> cells(kU * kTurn + 1, 0);
  const auto ring = static_cast<std::size_t>((kU - 1) * kTurn);
  for (int i = 0; i < kU * kFine; ++i)
    for (int j = 0; j < kTurn * kFine; ++j) {
      const Vec3 h = chart.half_vector((i + 0.5) / (kU * kFine), 2 * M_PI * (j + 0.5) / (kTurn * kFine));
      const double across = glm::dot(wo, h);
      const Vec3 wi = 2 * across * h - wo;
      if (across <= 0 || wi.z <= 0) continue;
      cells[static_cast<std::size_t>(i / kFine * kTurn + j / kFine)] +=
          s.specular_pdf(sampler, wo, wi) * s.directions_per_chart(wo, h) * 2 * M_PI / (kU * kTurn * kFine * kFine);
    }
  double sum = 0;
  for (std::size_t i = 0; i < ring; ++i) sum += cells[i];
  cells.resize(ring);
  cells.push_back(1 - sum);
  return cells;
}

class SamplerTest : public testing::TestWithParam<int> {};

TEST_P(SamplerTest, DrawsFromItsDensity) {
  const int sampler = GetParam();
  Probe probe(test_device(), Precision::Single);
  const int count = 60000;
  // 15 tests a sampler, seven samplers: one failure in a thousand runs of all (seeds are fixed, so it passes or fails).
  const double significance = sidak_significance(1e-3, 105);
  for (const double c : kViews)
    for (const double roughness : kRoughness) {
      const SurfaceReference s{Vec3(0.7), roughness, 0.5};
      const Vec3 wo = as_float(view_of(c));
      const bool lobe = is_lobe(sampler);
      const Samples drawn = draw(probe, sampler, s, wo, count, 11u, lobe ? 1.0 : 0.0);
      std::vector<double> expected, observed;
      if (lobe) {
        expected = expected_in_lobe(sampler, s, wo);
        observed.assign(expected.size(), 0);
        const LobeChart chart{s.alpha()};
        for (const Vec3& wi : drawn.wi) {
          const Vec3 h = glm::normalize(wo + wi);
          const double turn = std::atan2(h.y, h.x) / (2 * M_PI);
          const int i = static_cast<int>(chart.u(h) * kU);
          const int j = std::min(static_cast<int>((turn < 0 ? turn + 1 : turn) * kTurn), kTurn - 1);
          const bool apart = wi.z > 0 && i < kU - 1;
          observed[apart ? static_cast<std::size_t>(i * kTurn + j) : observed.size() - 1] += 1;
        }
      } else {  // cells of equal measure: in cos^2 for the cosine lobe, in cos for the uniform one
        expected.assign(kU * kTurn, 1.0 / (kU * kTurn));
        observed.assign(expected.size(), 0);
        for (const Vec3& wi : drawn.wi) {
          const double turn = std::atan2(wi.y, wi.x) / (2 * M_PI), x = sampler == kCosine ? wi.z * wi.z : wi.z;
          const int i = std::min(static_cast<int>(x * kU), kU - 1);
          const int j = std::min(static_cast<int>((turn < 0 ? turn + 1 : turn) * kTurn), kTurn - 1);
          observed[static_cast<std::size_t>(i * kTurn + j)] += 1;
        }
      }
      for (double& e : expected) e *= count;
      const ChiSquareTest test = chi_square_test(observed, expected);
      EXPECT_GT(test.p_value, significance) << "sampler " << sampler << ", view " << c << ", roughness " << roughness
                                            << ": chi-square " << test.statistic << " of " << test.degrees;
    }
}

// Three ways to the same number: the weight that comes with a sample, f cos / pdf by the textbook, and the density that
// came with the sample against the one that is asked for.
TEST_P(SamplerTest, WeightAndDensityAreThoseOfTheTextbook) {
  const int sampler = GetParam();
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    Probe probe(test_device(precision), precision);
    // About 60 roundings between directions and weight. At alpha = 1e-4 float directions are 6e-8 / 1e-4 of a lobe
    // apart, but D is made of the directions as they are, so that does not count. That they are unit to rounding does:
    // wo.h is |h| / 2 for unit directions, and moves by epsilon / (wo.h)^2 of itself.
    const double epsilon = precision == Precision::Single ? 1.2e-7 : 2.3e-16;
    for (const double c : kViews)
      for (const double roughness : kRoughness)
        for (const double metallic : {0.0, 0.6, 1.0}) {
          const SurfaceReference s{Vec3(0.7, 0.4, 0.1), static_cast<float>(roughness), static_cast<float>(metallic)};
          SurfaceReference exact = s;
          exact.albedo = precision == Precision::Single ? as_float(s.albedo) : s.albedo;
          const Vec3 wo = precision == Precision::Single ? as_float(view_of(c)) : view_of(c);
          const Samples drawn = draw(probe, sampler, exact, wo, 2000, 5u, -1.0);
          double worst_weight = 0, worst_pdf = 0;
          if (is_lobe(sampler)) {
            EXPECT_NEAR(drawn.lobe, exact.specular_probability(wo), 16 * epsilon);
          }
          for (std::size_t i = 0; i < drawn.wi.size(); ++i) {
            const Vec3& wi = drawn.wi[i];
            if (wi.z <= 0) {
              EXPECT_EQ(drawn.pdf[i], 0);
              EXPECT_EQ(glm::length(drawn.weight[i]), 0);
              continue;
            }
            const double across = glm::dot(wo, glm::normalize(wo + wi)),
                         scale = 60 * epsilon + epsilon / (across * across);
            const double pdf = exact.pdf(sampler, wo, wi, drawn.lobe);
            const Vec3 weight = exact.f_cos(wo, wi) / pdf;
            worst_pdf = worse(worst_pdf, std::abs(drawn.pdf[i] / pdf - 1) / scale);
            for (int k = 0; k < 3; ++k)
              worst_weight = worse(worst_weight, std::abs(drawn.weight[i][k] / weight[k] - 1) / scale);
          }
          EXPECT_LT(worst_weight, 1) << "sampler " << sampler << ", view " << c << ", roughness " << roughness
                                     << ", metallic " << metallic;
          EXPECT_LT(worst_pdf, 1) << "sampler " << sampler << ", view " << c << ", roughness " << roughness
                                  << ", metallic " << metallic;
        }
  }
}

// A lobe that reflects nothing is still drawn now and then: neither of the two has less than a share of 0.01 to 1.
TEST(Ggx, LobesOfBlackSurfacesKeepAShare) {
  Probe probe(test_device(), Precision::Single);
  for (const auto& [albedo, metallic] : {std::pair{Vec3(0), 0.0}, {Vec3(0), 1.0}, {Vec3(1), 1.0}, {Vec3(0.02), 0.5}}) {
    const SurfaceReference s{albedo, 0.3, metallic};
    const Vec3 wo = as_float(view_of(0.6));
    EXPECT_NEAR(draw(probe, 0, s, wo, 1, 1u, -1.0).lobe, s.specular_probability(wo), 16 * 1.2e-7);
  }
}

// White furnace: the mean weight under light 1 is the directional albedo, and single scattering never gains energy.
TEST_P(SamplerTest, FurnaceGivesTheDirectionalAlbedo) {
  const int sampler = GetParam();
  Probe probe(test_device(), Precision::Single);
  for (const double c : {0.95, 0.3})
    for (const double roughness : {0.1, 0.4, 0.9})
      for (const double metallic : {0.0, 1.0}) {
        if (!is_lobe(sampler) && roughness < 0.4) continue;  // a broad sampler almost never meets a narrow lobe
        const SurfaceReference s{Vec3(1.0), static_cast<float>(roughness), metallic};
        const Vec3 wo = as_float(view_of(c));
        const Samples drawn = draw(probe, sampler, s, wo, 100000, 3u, -1.0);
        std::vector<double> weights;
        for (const Vec3& w : drawn.weight) weights.push_back(w.x);
        const double estimate = mean(weights),
                     error = standard_deviation(weights) / std::sqrt(static_cast<double>(weights.size()));
        const double truth = s.directional_albedo(wo, 1500, 192).x;
        // 5 standard errors; the quadrature's own error is below 3e-4.
        EXPECT_NEAR(estimate, truth, 5 * error + 3e-4)
            << "sampler " << sampler << ", view " << c << ", roughness " << roughness << ", metallic " << metallic;
        if (metallic == 1) {
          EXPECT_LT(estimate, 1 + 5 * error);
        }
      }
}

INSTANTIATE_TEST_SUITE_P(Samplers, SamplerTest, testing::ValuesIn(kSamplers));

TEST(Ggx, IsReciprocal) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  const int count = 4000;
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    Probe probe(test_device(precision), precision);
    for (const double roughness : kRoughness) {
      std::vector<double> a(3 * count), b(3 * count);
      for (int i = 0; i < count; ++i)
        for (auto* rows : {&a, &b}) {
          const double turn = 2 * M_PI * unit(random), z = 0.02 + 0.98 * unit(random), r = std::sqrt(1 - z * z);
          const Vec3 v = as_float({r * std::cos(turn), r * std::sin(turn), z});
          for (int k = 0; k < 3; ++k) (*rows)[static_cast<std::size_t>(k * count + i)] = v[k];
        }
      const SurfaceReference s{Vec3(0.7, 0.4, 0.1), roughness, 0.4};
      const Buffer surface = probe.upload(s.values()), wo = probe.upload(a), wi = probe.upload(b);
      const std::vector<double> there = probe.run("probe_evaluate", 0, count, 5, {surface, wo, wi});
      const std::vector<double> back = probe.run("probe_evaluate", 0, count, 5, {surface, wi, wo});
      double worst = 0;
      for (int i = 0; i < count; ++i)
        for (int k = 1; k <= 3; ++k) {
          const auto at = static_cast<std::size_t>(k * count + i), z = static_cast<std::size_t>(2 * count + i);
          worst = worse(worst, std::abs(there[at] / b[z] / (back[at] / a[z]) - 1));
        }
      EXPECT_LT(worst, 40 * (precision == Precision::Single ? 1.2e-7 : 2.3e-16)) << "roughness " << roughness;
    }
  }
}

// Below the surface, on either side, there is nothing to see and nothing is drawn.
TEST(Ggx, BelowTheHorizonValuesAndDensitiesAreExactlyZero) {
  const SurfaceReference s{Vec3(0.7, 0.4, 0.1), 0.3, 0.4};
  Probe probe(test_device(), Precision::Single);
  const std::vector<double> up{0.6, 0.6, 0, 0, 0.8, 0.8}, down{-0.6, 0.6, 0, 0, -0.8, -0.8}, flat{0, 1, 1, 0, 0, 0};
  for (const int sampler : kSamplers)
    for (const auto& [wo, wi] : {std::pair{up, down}, {down, up}, {down, down}, {flat, up}, {up, flat}}) {
      const std::vector<double> out =
          probe.run("probe_evaluate", sampler, 2, 5, {probe.upload(s.values()), probe.upload(wo), probe.upload(wi)});
      for (std::size_t i = 2; i < out.size(); ++i) EXPECT_EQ(out[i], 0) << "sampler " << sampler << ", row " << i / 2;
    }
}

// The relative error of D in float over the width of the lobe, for half vectors drawn from the lobe and directions
// rounded to float, against the same source in double: flat, where forms with n.h lose all digits below alpha = 1e-3.
TEST(Ggx, DensityKeepsItsDigitsInNarrowLobes) {
  Probe single(test_device(), Precision::Single), twice(test_device(Precision::Double), Precision::Double);
  const int count = 20000;
  for (const double c : {0.95, 0.3, 0.05})
    for (const double alpha : {0.1, 0.03, 0.01, 1e-3, 1e-4}) {
      const SurfaceReference s{Vec3(0.5), std::sqrt(alpha), 0};
      const Vec3 wo = as_float(view_of(c));
      const Samples drawn = draw(single, 0, s, wo, count, 9u, 1.0);
      std::vector<double> a, b;
      for (int k = 0; k < 3; ++k)
        for (const Vec3& wi : drawn.wi) a.push_back(wo[k]), b.push_back(wi[k]);
      // alpha is rounded once, by the float kernel; give both the rounded roughness.
      SurfaceReference rounded = s;
      rounded.roughness = static_cast<float>(s.roughness);
      const std::vector<double> f = single.run("probe_evaluate", 0, count, 5,
                                               {single.upload(rounded.values()), single.upload(a), single.upload(b)});
      const std::vector<double> d =
          twice.run("probe_evaluate", 0, count, 5, {twice.upload(rounded.values()), twice.upload(a), twice.upload(b)});
      std::vector<double> errors;
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        if (drawn.wi[i].z > 0) errors.push_back(std::abs(f[i] / d[i] - 1));
      const double middle = median(errors), high = quantile(errors, 0.99);
      RecordProperty(fmt::format("D_alpha_{}_view_{}", alpha, c),
                     fmt::format("median {:.1e} p99 {:.1e}", middle, high));
      // alpha = R^2 costs one rounding, squared twice by D; about ten more in the form itself.
      EXPECT_LT(middle, 4e-7) << "alpha " << alpha << ", view " << c;
      EXPECT_LT(high, 1e-6) << "alpha " << alpha << ", view " << c;
    }
}

TEST(Frame, TurnsAndFramesAreExactToRounding) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  const int count = 8192;
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const double epsilon = precision == Precision::Single ? 1.2e-7 : 2.3e-16;
    Probe probe(test_device(precision), precision);
    std::vector<double> in(7 * count);
    for (int i = 0; i < count; ++i) {
      in[static_cast<std::size_t>(i)] = i / 8191.0;
      Vec3 n = glm::normalize(Vec3(normal(random), normal(random), i % 3 == 0 ? 0.0 : normal(random)));
      if (i < 6) n = Vec3(0), n[i / 2] = i % 2 ? -1 : 1;
      for (int k = 0; k < 3; ++k) {
        in[static_cast<std::size_t>((1 + k) * count + i)] = n[k];
        in[static_cast<std::size_t>((4 + k) * count + i)] = normal(random);
      }
    }
    if (precision == Precision::Single)
      for (double& x : in) x = static_cast<float>(x);
    const std::vector<double> out = probe.run("probe_frame", 0, count, 5, {probe.upload(in)});
    for (int i = 0; i < count; ++i) {
      const auto at = [&](const std::vector<double>& rows, int row) {
        return rows[static_cast<std::size_t>(row * count + i)];
      };
      ASSERT_NEAR(at(out, 0), std::cos(2 * M_PI * at(in, 0)), 4 * epsilon) << i;
      ASSERT_NEAR(at(out, 1), std::sin(2 * M_PI * at(in, 0)), 4 * epsilon) << i;
      double length = 0;
      for (int k = 0; k < 3; ++k) length += at(in, 4 + k) * at(in, 4 + k);
      // Nine products each way; the normal is unit to rounding.
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(at(out, 2 + k), at(in, 4 + k), 16 * epsilon * std::sqrt(length)) << i;
    }
  }
}

}  // namespace
}  // namespace clerestory
