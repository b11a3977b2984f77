// Directions drawn towards lamps, in the kernel that draws them: from the density that they state, and worth f cos over
// it.
#include "host/ops/shade/light_guide.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/shade/light_guide_reference.hpp"
#include "host/graph/plan.hpp"
#include "host/math/statistics.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using namespace light_guide_reference;

constexpr int kSamplers[] = {0, 1, 2, 3, 4, 5, 7};  // all but the grid

/// What is drawn for maps(20) with lamps(), all materials as rough.
struct Rays {
  Tensors maps;
  Tensor direction, weight, pdf, status, rows;

  Rays(int sampler, double roughness, int samples, Precision precision) : maps(sample_brdf_reference::maps(20)) {
    for (int n = 0; n < kBatch; ++n)
      for (int i = 0; i < kPlane; ++i)
        maps["material"].at(n, 0, i / kWidth, i % kWidth) = static_cast<float>(roughness);
    maps["lamps"] = lamps();
    for (auto& [name, tensor] : maps)
      for (double& v : tensor.real) v = static_cast<float>(v);
    Graph graph;
    Values v;
    for (const auto& [name, tensor] : maps) v[name] = graph.input(name, tensor.shape);
    const Surfaces surfaces{v["albedo"], v["normal"], v["material"]};
    const Value guide = light_guide(v["depth"], v["camera"], surfaces, v["lamps"], kRows);
    const BrdfSamples drawn =
        sample_brdf(v["depth"], v["camera"], surfaces, surfaces, kRows, samples,
                    {.sampler = static_cast<Sampler>(sampler), .points = Points::Independent}, guide);
    const std::vector<Tensor> got = evaluate(graph, {drawn.direction, drawn.weight, drawn.pdf, drawn.status, guide},
                                             test_device(precision), maps, {.precision = precision}, 3);
    direction = got[0], weight = got[1], pdf = got[2], status = got[3], rows = got[4];
  }
  Vec3 at(const Tensor& rays, int p, int s) const {
    return {rays.at(0, 0, p, s), rays.at(0, 1, p, s), rays.at(0, 2, p, s)};
  }
  Frame frame(int p) const { return frame_around(glm::normalize(pixel_of(maps.at("normal"), p))); }
  Vec3 view(int p) const {
    return frame(p).to_local(-camera_in(maps).direction(p % kWidth + 0.5, p % kPlane / kWidth + 0.5));
  }
  /// By the textbook, of a direction above the surface: of the guide and of the sampler, each as often as it draws.
  double density(int sampler, int p, const Vec3& local) const {
    const SurfaceReference s = surface_of(maps, "", p);
    return (1 - rows.at(p, 0, 0, 0)) * s.pdf(sampler, view(p), local, s.specular_probability(view(p))) +
           guide_density(rows, p, frame(p).from_local(local));
  }
  bool shaded(int p) const { return status.at(0, 0, p, 0) == 0; }
};

TEST(LightGuide, DirectionsHaveTheDensityOfLampsAndSurfaceTogether) {
  constexpr int samples = 16384, up = 8, around = 16, fine = 24;
  const Rays rays(0, 0.6, samples, Precision::Single);
  // A false alarm in a thousand choices of seeds over all pixels; the seed is fixed.
  const double significance = sidak_significance(1e-3, kRows);
  int tested = 0;
  for (int p = 0; p < kRows; ++p) {
    if (!rays.shaded(p) || rays.rows.at(p, 0, 0, 0) == 0) continue;
    std::vector<double> expected(up * around + 1, 0), observed = expected;
    for (int i = 0; i < up * fine; ++i)
      for (int j = 0; j < around * fine; ++j) {
        const double z = (i + 0.5) / (up * fine), turn = 2 * M_PI * (j + 0.5) / (around * fine),
                     r = std::sqrt(1 - z * z);
        expected[static_cast<std::size_t>(i / fine * around + j / fine)] +=
            rays.density(0, p, {r * std::cos(turn), r * std::sin(turn), z}) * 2 * M_PI / (up * around * fine * fine);
      }
    for (std::size_t i = 0; i + 1 < expected.size(); ++i) expected.back() -= expected[i];
    expected.back() += 1;  // below the surface
    for (double& e : expected) e = std::max(e, 0.0) * samples;
    for (int s = 0; s < samples; ++s) {
      const Vec3 local = rays.frame(p).to_local(rays.at(rays.direction, p, s));
      const double turn = std::atan2(local.y, local.x) / (2 * M_PI);
      const int i = std::min(static_cast<int>(local.z * up), up - 1);
      const int j = std::min(static_cast<int>((turn < 0 ? turn + 1 : turn) * around), around - 1);
      observed[rays.pdf.at(0, 0, p, s) > 0 ? static_cast<std::size_t>(i * around + j) : observed.size() - 1] += 1;
    }
    EXPECT_GT(chi_square_test(observed, expected).p_value, significance) << "pixel " << p;
    ++tested;
  }
  EXPECT_GT(tested, kRows / 2) << "too few pixels are guided";
}

TEST(LightGuide, WeightAndDensityAreThoseOfTheTextbookWithEverySampler) {
  for (const Precision precision : {Precision::Single, Precision::Double})
    for (const int sampler : kSamplers)
      for (const double roughness : {0.3, 0.8}) {
        const Rays rays(sampler, roughness, 256, precision);
        // Directions go through the camera's frame and are good to some 1e-7 (float), which a lobe as narrow as 0.03
        // (sharpness up to a thousand, alpha 0.09) makes thirty times that, squared in D twice as much.
        const double tolerance = precision == Precision::Single ? 2e-4 : 1e-12;
        int guided = 0;
        for (int p = 0; p < kRows; ++p)
          for (int s = 0; s < 256 && rays.shaded(p); ++s) {
            const double pdf = rays.pdf.at(0, 0, p, s);
            if (pdf == 0) continue;
            const Vec3 local = rays.frame(p).to_local(rays.at(rays.direction, p, s));
            if (local.z < 1e-3) continue;  // the horizon's own rounding
            ASSERT_NEAR(pdf, rays.density(sampler, p, local), tolerance * pdf) << sampler << " " << p << " " << s;
            const Vec3 weight = rays.at(rays.weight, p, s),
                       want = surface_of(rays.maps, "", p).f_cos(rays.view(p), local) / pdf;
            for (int c = 0; c < 3; ++c)
              ASSERT_NEAR(weight[c], want[c], 2 * tolerance * want[c]) << sampler << " " << p << " " << s;
            guided += guide_density(rays.rows, p, rays.at(rays.direction, p, s)) > 0.5 * pdf;
          }
        EXPECT_GT(guided, 10 * kRows) << "few directions go to lamps";
      }
}

// A guide only chooses: no map has a gradient through it, and what does not fit is refused.
TEST(LightGuide, RefusesWhatDoesNotFit) {
  Graph g;
  const Value depth = g.input("depth", {1, 1, 4, 4}), camera = g.input("camera", {1, 4, 1, 1});
  const Surfaces s{g.input("albedo", {1, 3, 4, 4}), g.input("normal", {1, 3, 4, 4}), g.input("material", {1, 2, 4, 4})};
  EXPECT_THROW(light_guide(depth, camera, s, g.input("few", {1, 4, 1, 2}), 16), Error);
  EXPECT_THROW(light_guide(depth, camera, {s.albedo, depth, s.material}, g.input("lamps", {1, 5, 1, 2}), 16), Error);
  const Value guide = light_guide(depth, camera, s, g.input("known", {1, 5, 1, 2}), 16);
  EXPECT_EQ(guide.shape(), (Shape{16, 14, 1, 1}));
  EXPECT_THROW(sample_brdf(depth, camera, s, s, 8, 16, {}, guide), Error);
  EXPECT_THROW(sample_brdf(depth, camera, s, s, 16, 128, {.sampler = Sampler::Grid8x16}, guide), Error);
}

}  // namespace
}  // namespace clerestory
