// The op that draws directions, against the surface model and the hash written again.
#include "host/ops/shade/sample_brdf.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks/op_case.hpp"
#include "checks/shade/sample_brdf_reference.hpp"
#include "host/math/frames.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "tests/cl/environment.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

using namespace sample_brdf_reference;

// Where the lobe itself draws: its peak, widths down to the least alpha. In double; a float's direction is not the
// same.
TEST(SampleBrdf, GradientsOfLobesAgainstDifferences) {
  for (const double roughness : {0.02, 0.1, 0.3, 0.8}) {
    Tensors t = same_twice(roughness);
    Graph graph;
    Values v;
    for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
    const BrdfSamples drawn = sample_brdf(v["depth"], v["camera"], {v["albedo"], v["normal"], v["material"]},
                                          {v["e_albedo"], v["e_normal"], v["e_material"]}, kRows, 16,
                                          {.points = Points::Independent, .lobes = true});
    // The share alone has no slope of use where a part is nearly nothing: of black, or of metal beside its lobe.
    const std::vector<Value> drawn_values{drawn.weight, multiply(drawn.weight, drawn.lobes.specular),
                                          drawn.lobes.density};
    std::vector<Tensor> cotangents{random_tensor({1, 3, kRows, 16}, 5), random_tensor({1, 3, kRows, 16}, 6),
                                   random_tensor({1, 1, kRows, 16}, 7)};
    const std::vector<std::string> names{"e_normal", "e_albedo", "e_material"};
    const double alpha = std::max(roughness * roughness, 1e-4);
    for (double& d : cotangents[2].real) d *= alpha * alpha;  // a lobe's density reaches 1 / (pi alpha^2)
    std::vector<Value> seeds;
    for (const Tensor& c : cotangents) seeds.push_back(graph.constant(c));
    const std::vector<Value> gradients =
        gradient(drawn_values, seeds, std::vector{v["e_normal"], v["e_albedo"], v["e_material"]});
    std::vector<Value> outputs = drawn_values;
    outputs.insert(outputs.end(), gradients.begin(), gradients.end());
    Executor executor(compile(graph, outputs, test_device(Precision::Double), {.precision = Precision::Double}));
    for (const auto& [name, tensor] : t) executor.feed(name, tensor);
    const auto weighed = [&] {
      executor.run(1);
      double sum = 0;
      for (std::size_t k = 0; k < drawn_values.size(); ++k) {
        const Tensor value = executor.fetch(drawn_values[k]);
        for (std::size_t i = 0; i < value.real.size(); ++i) sum += value.real[i] * cotangents[k].real[i];
      }
      return sum;
    };
    weighed();
    std::vector<Tensor> stated;
    for (const Value& g : gradients) stated.push_back(executor.fetch(g));
    // A lobe of width alpha turns over within alpha: a difference errs by (step / alpha)^2 of the gradient, and by
    // rounding, 1e-16 of the sum over the step.
    const double step = 1e-4 * alpha;
    for (std::size_t k = 0; k < names.size(); ++k) {
      double largest = 0;
      for (const double g : stated[k].real) largest = std::max(largest, std::abs(g));
      ASSERT_GT(largest, 0) << names[k];
      Tensor& moved = t[names[k]];
      for (std::size_t i = 0; i < moved.real.size(); ++i) {
        const double kept = moved.real[i];
        const auto at = [&](double value) {
          moved.real[i] = value;
          executor.feed(names[k], moved);
          return weighed();
        };
        const double difference = (at(kept + step) - at(kept - step)) / (2 * step);
        at(kept);
        EXPECT_NEAR(stated[k].real[i], difference, 1e-6 * largest + 1e-13 / step)
            << names[k] << " element " << i << " roughness " << roughness;
      }
    }
  }
}

// Sixteen samples in a vector are those that work-items draw one by one, to the last bit. (Towards lamps exp() and its
// like decide, whose last digit is another in a vector.)
TEST(SampleBrdf, SamplesSideBySideHaveTheBitsOfSingleOnes) {
  const Tensors t = maps(3);
  for (const Sampler sampler : {Sampler::VndfCaps, Sampler::VndfHemisphere, Sampler::VndfBounded, Sampler::Ndf,
                                Sampler::Cosine, Sampler::Uniform, Sampler::NdfRoughness})
    for (const Points points : {Points::Independent, Points::Sobol}) {
      Graph graph;
      Values v;
      for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
      const Surfaces surfaces{v["albedo"], v["normal"], v["material"]};
      const BrdfSamples s = sample_brdf(v["depth"], v["camera"], surfaces, surfaces, kRows, 48,
                                        {.sampler = sampler, .points = points, .lobes = true});
      const std::vector<Value> outputs{s.direction, s.weight, s.pdf, s.status, s.lobes.specular, s.lobes.density};
      std::vector<std::vector<Tensor>> drawn;
      for (const char* group : {"1", "16"}) {
        const ScopedVariable side_by_side("CLERESTORY_GROUP", group);
        Executor executor(compile(graph, outputs, test_device(Precision::Single), {}));
        for (const auto& [name, tensor] : t) executor.feed(name, tensor);
        executor.run(1);
        std::vector<Tensor>& of = drawn.emplace_back();
        for (const Value& output : outputs) of.push_back(executor.fetch(output));
      }
      for (std::size_t k = 0; k < outputs.size(); ++k)
        EXPECT_EQ(drawn[0][k].real, drawn[1][k].real) << "output " << k << " of sampler " << static_cast<int>(sampler);
    }
}

// Evaluation normals under whose horizon the viewer lies, or a direction that the sampling normal drew: such samples
// are worth nothing, and turning the normal a little does not change that, so no map has a gradient there, not a small
// one.
TEST(SampleBrdf, BelowTheHorizonOfTheEvaluationNormalGradientsAreExactlyZero) {
  Tensors t = same_twice(0.4);
  Tensor& normal = t["e_normal"];
  const auto view = [&](int p) { return -camera_in(t).direction(p % kWidth + 0.5, p % kPlane / kWidth + 0.5); };
  for (int p = 0; p < kRows; ++p) {
    // The upper rows look away from the viewer, the others face him at 80 degrees.
    const Vec3 side = glm::normalize(glm::cross(view(p), Vec3(0.3, 1, 0.2)));
    const double angle = (p % kPlane < kWidth ? 1.9 : 1.4) + 0.01 * p;
    const Vec3 n = std::cos(angle) * view(p) + std::sin(angle) * side;
    for (int c = 0; c < 3; ++c) normal.at(p / kPlane, c, p % kPlane / kWidth, p % kWidth) = n[c];
  }
  const Vec3 away = pixel_of(normal, 0), faces = pixel_of(normal, kWidth);
  ASSERT_LT(glm::dot(away, view(0)), -0.1);
  ASSERT_GT(glm::dot(faces, view(kWidth)), 0.1);

  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  v["cotangent"] = graph.input("cotangent", {1, 3, kRows, 16});
  const BrdfSamples drawn =
      sample_brdf(v["depth"], v["camera"], {v["albedo"], v["normal"], v["material"]},
                  {v["e_albedo"], v["e_normal"], v["e_material"]}, kRows, 16, {.points = Points::Independent});
  std::vector<Value> outputs = gradient(std::vector{drawn.weight}, std::vector{v["cotangent"]},
                                        std::vector{v["e_normal"], v["e_albedo"], v["e_material"]});
  outputs.insert(outputs.end(), {drawn.weight, drawn.direction, drawn.pdf});
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    Executor executor(compile(graph, outputs, test_device(precision), {.precision = precision}));
    for (const auto& [name, tensor] : t) executor.feed(name, tensor);
    executor.feed("cotangent", Tensor({1, 3, kRows, 16}));
    executor.run(1);
    const Tensor weight = executor.fetch(drawn.weight), direction = executor.fetch(drawn.direction),
                 pdf = executor.fetch(drawn.pdf);
    Tensor cotangent(weight.shape);
    int viewer_below = 0, light_below = 0;
    for (int p = 0; p < kRows; ++p)
      for (int s = 0; s < 16; ++s) {
        const Vec3 d{direction.at(0, 0, p, s), direction.at(0, 1, p, s), direction.at(0, 2, p, s)};
        const Vec3 n = glm::normalize(pixel_of(normal, p));
        const bool viewer = glm::dot(n, view(p)) < 0, light = glm::dot(n, d) < -1e-6;
        if (pdf.at(0, 0, p, s) == 0 || (!viewer && !light)) continue;
        viewer_below += viewer && !light, light_below += light && !viewer;
        for (int c = 0; c < 3; ++c) {
          EXPECT_EQ(weight.at(0, c, p, s), 0);
          cotangent.at(0, c, p, s) = 1 + c;
        }
      }
    EXPECT_GT(viewer_below, 20);  // each of the two conditions alone
    EXPECT_GT(light_below, 20);
    executor.feed("cotangent", cotangent);
    executor.run(1);
    for (std::size_t k = 0; k < 3; ++k)
      for (const double g : executor.fetch(outputs[k]).real) ASSERT_EQ(g, 0) << "map " << k;
  }
}

// Their model's denominator is clamped at both ends, which directions drawn at the peak of narrow lobes and far from it
// meet; in double, from the directions that were drawn.
TEST(SampleBrdf, Li2020sModelIsTheirsFromThePeakOfTheLobeToItsTail) {
  Tensors t = same_twice(0.05);
  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const Surfaces surfaces{v["albedo"], v["normal"], v["material"]};
  const BrdfSamples drawn = sample_brdf(v["depth"], v["camera"], surfaces, surfaces, kRows, 64,
                                        {.points = Points::Independent, .brdf = BrdfModel::Li2020});
  const std::vector<Tensor> got = evaluate(graph, {drawn.direction, drawn.weight, drawn.pdf},
                                           test_device(Precision::Double), t, {.precision = Precision::Double}, 1);
  int peak = 0, tail = 0;
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < 64; ++s) {
      if (got[2].at(0, 0, p, s) == 0) continue;
      const Frame frame = frame_around(glm::normalize(pixel_of(t["normal"], p)));
      const Vec3 wo = frame.to_local(-camera_in(t).direction(p % kWidth + 0.5, p % kPlane / kWidth + 0.5));
      const Vec3 wi = frame.to_local({got[0].at(0, 0, p, s), got[0].at(0, 1, p, s), got[0].at(0, 2, p, s)});
      const double hz = glm::normalize(wo + wi).z;
      peak += 1 - hz * hz<1e-5, tail += 1 - hz * hz> 0.1;
      const Vec3 want = weigh_li2020(surface_of(t, "", p), wo, wi).f_cos / got[2].at(0, 0, p, s);
      // 1 - h.z^2 is formed with an error of 1e-16 beside the clamp's 1e-6: digits are lost, not the value.
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(got[1].at(0, c, p, s), want[c], 1e-7 * want[c]) << p << " " << s;
    }
  EXPECT_GT(peak, 50);
  EXPECT_GT(tail, 50);
}

/// Gradients of the sum of one ray's weights a pixel, by map, and which ray: {1, C, pixels, 1} each.
std::vector<Tensor> gradients_of_rays(const Tensors& t, Precision precision, Sampler sampler) {
  const Shape picture = t.at("depth").shape;
  const int pixels = static_cast<int>(picture.plane());
  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const Surfaces maps{v["albedo"], v["normal"], v["material"]};
  const BrdfSamples drawn = sample_brdf(v["depth"], v["camera"], maps, maps, pixels, 16, {.sampler = sampler});
  Tensor first(Shape{1, 3, pixels, 16});
  for (int c = 0; c < 3; ++c)
    for (int p = 0; p < pixels; ++p) first.at(0, c, p, 0) = 1;
  const std::vector<Value> gradients = gradient(std::vector{drawn.weight}, std::vector{graph.constant(first)},
                                                std::vector{v["normal"], v["albedo"], v["material"]});
  Executor executor(compile(graph, gradients, test_device(precision), {.precision = precision}));
  for (const auto& [name, tensor] : t) executor.feed(name, tensor);
  executor.run(1);
  std::vector<Tensor> found;
  for (const Value& g : gradients) found.push_back(executor.fetch(g));
  return found;
}

// The adjoint sees the very ray that was drawn: a direction that went to the camera's frame and back is good to 6e-8,
// which of a lobe of width alpha is 6e-8 / alpha.
TEST(SampleBrdf, GradientsInFloatAreThoseInDoubleDownToTheNarrowestLobe) {
  constexpr int w = 96, h = 64;
  const Camera eye = Camera::from_fov(w, h, 75.0);
  Tensors t{{"depth", Tensor(Shape{1, 1, h, w}, 2)},
            {"normal", Tensor(Shape{1, 3, h, w})},
            {"albedo", random_tensor({1, 3, h, w}, 2, 0.1, 0.9)},
            {"material", Tensor(Shape{1, 2, h, w})},
            {"camera", camera_tensor(std::span(&eye, 1))}};
  const Tensor turn = random_tensor({1, 3, h, w}, 4, -0.5, 0.5);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      t["material"].at(0, 1, y, x) = x % 2;
      const Vec3 view = -eye.direction(x + 0.5, y + 0.5);
      for (int c = 0; c < 3; ++c) t["normal"].at(0, c, y, x) = static_cast<float>(view[c] + turn.at(0, c, y, x));
    }
  for (double& a : t["albedo"].real) a = static_cast<float>(a);
  for (const Sampler sampler : {Sampler::VndfCaps, Sampler::VndfHemisphere, Sampler::VndfBounded, Sampler::Ndf})
    for (const float roughness : {0.01f, 0.02f, 0.05f}) {
      for (int i = 0; i < w * h; ++i) t["material"].real[static_cast<std::size_t>(i)] = roughness;
      const std::vector<Tensor> single = gradients_of_rays(t, Precision::Single, sampler),
                                twin = gradients_of_rays(t, Precision::Double, sampler);
      for (std::size_t k = 0; k < twin.size(); ++k) {  // normal, albedo, material
        std::vector<double> errors;
        for (int y = 0; y < h; ++y)
          for (int x = 0; x < w; ++x) {
            double difference = 0, size = 0;
            for (int c = 0; c < twin[k].shape.c; ++c) {
              difference += std::pow(single[k].at(0, c, y, x) - twin[k].at(0, c, y, x), 2);
              size += std::pow(twin[k].at(0, c, y, x), 2);
            }
            if (size > 0) errors.push_back(std::sqrt(difference / size));
          }
        ASSERT_GT(errors.size(), 0.6 * w * h);
        EXPECT_LT(quantile(std::span<const double>(errors), 0.999), 1e-4) << "roughness " << roughness << ", map " << k;
      }
    }
}

TEST(SampleBrdf, ACotangentThatIsNoNumberIsNotHidden) {
  const Tensors t = same_twice(0.5);
  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const BrdfSamples drawn =
      sample_brdf(v["depth"], v["camera"], {v["albedo"], v["normal"], v["material"]},
                  {v["e_albedo"], v["e_normal"], v["e_material"]}, kRows, 16, {.points = Points::Independent});
  Tensor cotangent({1, 3, kRows, 16}, 1);
  for (int s = 0; s < 16; ++s) cotangent.at(0, 0, 1, s) = NAN;  // all rays of the second row
  const Value albedo =
      gradient(std::vector{drawn.weight}, std::vector{graph.constant(cotangent)}, std::vector{v["e_albedo"]})[0];
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const Tensor g = evaluate(graph, {albedo}, test_device(precision), t, {.precision = precision})[0];
    for (int row = 0; row < kRows; ++row) {
      const int picture = row / kPlane, pixel = row % kPlane;
      EXPECT_EQ(std::isnan(g.at(picture, 0, pixel / kWidth, pixel % kWidth)), row == 1) << row;
    }
  }
}

TEST(SampleBrdf, NamesAndLimits) {
  EXPECT_EQ(sampler_of("grid8x16"), Sampler::Grid8x16);
  EXPECT_EQ(points_of("sobol"), Points::Sobol);
  EXPECT_THROW(sampler_of("vndf"), Error);
  EXPECT_THROW(points_of("halton"), Error);
  EXPECT_THROW(brdf_model_of("phong"), Error);
  Graph g;
  const Value depth = g.input("depth", {1, 1, 4, 4}), camera = g.input("camera", {1, 4, 1, 1});
  const Surfaces s{g.input("albedo", {1, 3, 4, 4}), g.input("normal", {1, 3, 4, 4}), g.input("material", {1, 2, 4, 4})};
  EXPECT_THROW(sample_brdf(depth, camera, s, s, 16, 20), Error);
  EXPECT_THROW(sample_brdf(depth, camera, {s.albedo, s.normal, depth}, s, 16, 16), Error);
  EXPECT_THROW(sample_brdf(depth, camera, s, s, 16, 256, {.sampler = Sampler::Grid8x16}), Error);
}

}  // namespace
}  // namespace clerestory
