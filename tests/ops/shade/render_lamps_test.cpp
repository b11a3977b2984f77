// The picture of a wall that lamps light, against quadrature in double: whoever draws the directions, it is the same.
#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/surface_reference.hpp"
#include "host/graph/map_chunks.hpp"
#include "host/graph/plan.hpp"
#include "host/ops/light/soft_lamps.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/render.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 8, kHeight = 6, kPixels = kWidth * kHeight, kLamps = 2;

const Camera kCamera = Camera::from_fov(kWidth, kHeight, 70.0);

// Middle and size, metres: behind the camera and near it, so that some pixels mirror them; and their colours.
constexpr double kPlaces[4][kLamps] = {{0.9, -1.2}, {0.6, 0.4}, {0.8, 0.3}, {1.5, 1.2}};

constexpr double kColors[3][kLamps] = {{3, 1}, {2, 2}, {1, 4}};

/// A wall 2 m ahead, every sixth pixel of metal: rays that leave it meet nothing.
Tensors wall_before_lamps(double roughness) {
  Tensors t{{"depth", Tensor(Shape{1, 1, kHeight, kWidth}, 2)},
            {"normal", Tensor(Shape{1, 3, kHeight, kWidth})},
            {"albedo", random_tensor({1, 3, kHeight, kWidth}, 1, 0.2, 0.9)},
            {"material", Tensor(Shape{1, 2, kHeight, kWidth}, roughness)},
            {"camera", camera_tensor(std::span(&kCamera, 1))},
            {"places", Tensor(Shape{1, 4, 1, kLamps})},
            {"colors", Tensor(Shape{1, 3, 1, kLamps})}};
  for (int i = 0; i < kPixels; ++i) {
    t["normal"].at(0, 2, i / kWidth, i % kWidth) = 1;
    t["material"].at(0, 1, i / kWidth, i % kWidth) = i % 6 == 0;
  }
  for (int k = 0; k < kLamps; ++k) {
    for (int c = 0; c < 4; ++c) t["places"].at(0, c, 0, k) = kPlaces[c][k];
    for (int c = 0; c < 3; ++c) t["colors"].at(0, c, 0, k) = kColors[c][k];
  }
  t["range"] = depth_range(t["depth"]);
  return t;
}

/// The lamps as those who draw directions towards them know them.
Tensor known_lamps() {
  Tensor known(Shape{1, 5, 1, kLamps});
  for (int k = 0; k < kLamps; ++k) {
    for (int c = 0; c < 4; ++c) known.at(0, c, 0, k) = kPlaces[c][k];
    known.at(0, 4, 0, k) = kColors[1][k];
  }
  return known;
}

/// What lamp k gives along wi to a lobe of this density (1/sr; 0: to a Lambertian part).
double lamp_seen(const Vec3& point, const Vec3& wi, int k, double density) {
  const Vec3 to = Vec3(kPlaces[0][k], kPlaces[1][k], kPlaces[2][k]) - point;
  const double sharpness = glm::dot(to, to) / (kPlaces[3][k] * kPlaces[3][k]);
  const double share = density > 0 ? std::min(1.0, (2 + sharpness) / (2 * M_PI * density)) : 1;
  return share * std::exp(-sharpness * (1 - glm::dot(glm::normalize(to), wi)));
}

/// What the surface at `point` sends to wo (local = world but for the point: the wall's normal is z).
Vec3 reflected_light(const SurfaceReference& s, const Vec3& point, const Vec3& wo) {
  const auto lamps = [&](const Vec3& wi, double density) {
    Vec3 sum(0);
    for (int k = 0; k < kLamps; ++k)
      sum += Vec3(kColors[0][k], kColors[1][k], kColors[2][k]) * lamp_seen(point, wi, k, density);
    return sum;
  };
  constexpr int rows = 300, turns = 96;
  const LobeChart chart{s.alpha()};
  Vec3 sum(0);
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < turns; ++j) {
      const double x = (i + 0.5) / rows, turn = 2 * M_PI * (j + 0.5) / turns;
      // Lambertian: by cosine, cells of equal weight.
      const Vec3 wi{std::sqrt(x) * std::cos(turn), std::sqrt(x) * std::sin(turn), std::sqrt(1 - x)};
      sum += s.albedo * (1 - s.metallic) * lamps(wi, 0) / (rows * 1.0 * turns);
      // The lobe: u = 1 - (1 - x)^2 of its own chart puts cells where rough lobes end.
      const Vec3 h = chart.half_vector(1 - (1 - x) * (1 - x), turn);
      const double across = glm::dot(wo, h);
      const Vec3 out = 2 * across * h - wo;
      if (across <= 0 || out.z <= 0) continue;
      const Vec3 specular = s.f_cos(wo, out) - s.diffuse_f_cos(out);
      sum += specular * lamps(out, s.specular_pdf(0, wo, out)) *
             (s.directions_per_chart(wo, h) * 2 * (1 - x) * 2 * M_PI / (rows * turns));
    }
  return sum;
}

TEST(LampsPicture, IsTheSameWhoeverDraws) {
  for (const double roughness : {0.05, 0.2, 0.6}) {
    const Tensors t = wall_before_lamps(roughness);
    std::vector<Vec3> truth;
    double all = 0;
    for (int i = 0; i < kPixels; ++i) {
      const int y = i / kWidth, x = i % kWidth;
      const auto albedo = [&](int c) { return t.at("albedo").at(0, c, y, x); };
      const SurfaceReference s{{albedo(0), albedo(1), albedo(2)}, roughness, t.at("material").at(0, 1, y, x)};
      truth.push_back(reflected_light(s, kCamera.unproject(x + 0.5, y + 0.5, 2), -kCamera.direction(x + 0.5, y + 0.5)));
      all += truth.back().x + truth.back().y + truth.back().z;
    }
    for (const char* name : {"vndf_caps", "vndf_hemisphere", "vndf_bounded", "ndf", "cosine", "uniform", "guided"})
      for (const Points points : {Points::Independent, Points::Sobol}) {
        Graph graph;
        Values v;
        for (const auto& [input, tensor] : t) v[input] = graph.input(input, tensor.shape);
        RenderSpec spec{.spp = 4096};
        spec.sampling.points = points, spec.sampling.lobes = true;
        if (std::string(name) == "guided")
          spec.lamps = graph.constant(known_lamps());
        else
          spec.sampling.sampler = sampler_of(name);
        const auto light = [](Graph& g, const RayBatch& rays, std::span<const Value> in) {
          const Value dark = g.fill(rays.direction.shape(), 0);
          const Value points_of_rows = take_pixels(in[2], rays.direction.shape().h);
          return add_lamps(dark, {points_of_rows, rays.direction, rays.hits.u, rays.lobes}, in[0], in[1]);
        };
        const Rendered r =
            render(graph, spec, {v["depth"], {v["albedo"], v["normal"], v["material"]}}, v["camera"], v["range"],
                   std::vector{v["places"], v["colors"], surface_points(v["depth"], v["camera"])}, light);
        Executor executor(compile(graph, {r.radiance, r.standard_error}, test_device()));
        for (const auto& [input, tensor] : t) executor.feed(input, tensor);
        executor.run(3);
        const Tensor picture = executor.fetch(r.radiance), error = executor.fetch(r.standard_error);
        double difference = 0, variance = 0;
        for (int i = 0; i < kPixels; ++i)
          for (int c = 0; c < 3; ++c) {
            difference += picture.at(0, c, i / kWidth, i % kWidth) - truth[static_cast<std::size_t>(i)][c];
            variance += 3 * std::pow(error.at(0, c, i / kWidth, i % kWidth), 2);  // channels of a pixel move together
          }
        // 4 standard errors, and the quadrature's part: with more of its cells it moves by less.
        const double error_of_sum = std::sqrt(variance);
        EXPECT_LT(error_of_sum, 0.005 * all) << name << ", roughness " << roughness << ": the test sees nothing";
        EXPECT_NEAR(difference, 0, 4 * error_of_sum + 2e-4 * all) << name << ", roughness " << roughness;
      }
  }
}

}  // namespace
}  // namespace clerestory
