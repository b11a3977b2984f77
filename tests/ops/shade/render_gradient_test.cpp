// The layer's adjoint: exact at equal seeds, unbiased over different ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "checks/op_case.hpp"
#include "host/graph/plan.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/shade/render.hpp"
#include "tests/ops/shade/wall.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {
namespace {

// The adjoint replays each chunk from the seed: against differences at equal seeds, with chunks of pixels and of
// samples, under a light that is traced; what draws the samples stays.
class EqualSeeds : public testing::TestWithParam<bool> {};

TEST_P(EqualSeeds, GiveTheGradientOfTheEstimate) {
  const bool guided = GetParam();
  const int w = 6, h = 4;
  Tensors t = wall(w, h, 0.4, 0.3);
  t["depth"].at(0, 0, 1, 1) = 0;
  for (const char* name : {"albedo", "normal", "material"}) t[std::string("s_") + name] = t[name];
  const std::vector<std::string> names{"albedo", "normal", "material", "image", "ambient"};
  std::vector<Tensor> gradients_of_chunks;
  for (const int chunk_rays : {1 << 18, 80}) {
    Graph graph;
    Values v;
    for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
    RenderSpec spec;
    spec.spp = 32, spec.chunk_rays = chunk_rays;
    if (guided) spec.lamps = graph.constant(lamp_of_wall());
    const Value radiance = render(graph, spec, {v["depth"], {v["albedo"], v["normal"], v["material"]}}, v["camera"],
                                  v["range"], std::vector{v["image"], v["ambient"]}, image_answers, {},
                                  {v["s_albedo"], v["s_normal"], v["s_material"]})
                               .radiance;
    const Tensor cotangent = random_tensor(radiance.shape(), 9);
    const std::vector<Value> gradients =
        gradient(std::vector{radiance}, std::vector{graph.constant(cotangent)},
                 std::vector{v["albedo"], v["normal"], v["material"], v["image"], v["ambient"]});
    std::vector<Value> outputs{radiance};
    outputs.insert(outputs.end(), gradients.begin(), gradients.end());
    Executor executor(compile(graph, outputs, test_device(Precision::Double), {.precision = Precision::Double}));
    for (const auto& [name, tensor] : t) executor.feed(name, tensor);
    const auto loss = [&] {
      executor.run(3);
      const Tensor picture = executor.fetch(radiance);
      double sum = 0;
      for (std::size_t i = 0; i < picture.real.size(); ++i) sum += picture.real[i] * cotangent.real[i];
      return sum;
    };
    loss();
    std::vector<Tensor> stated;
    for (const Value& g : gradients) stated.push_back(executor.fetch(g));
    for (std::size_t k = 0; k < names.size(); ++k) {
      double largest = 0;
      for (const double g : stated[k].real) largest = std::max(largest, std::abs(g));
      ASSERT_GT(largest, 0) << names[k];
      // Chunks add in another order: 1e-13 is 900 roundings, of as many rays, 23 pixels with 32 each.
      if (chunk_rays == 80) {
        for (std::size_t i = 0; i < stated[k].real.size(); ++i)
          EXPECT_NEAR(stated[k].real[i], gradients_of_chunks[k].real[i], 1e-13 * largest);
        continue;
      }
      for (std::size_t i = 0; i < stated[k].real.size(); i += 5) {
        Tensor moved = t[names[k]];
        const double step = 1e-5;
        double ends[2];
        for (const int side : {0, 1}) {
          moved.real[i] = t[names[k]].real[i] + (side == 1 ? step : -step);
          executor.feed(names[k], moved);
          ends[side] = loss();
        }
        executor.feed(names[k], t[names[k]]);
        // The difference errs by step^2 of the third slope, 1e-10 times up to 1000 of the gradient.
        EXPECT_NEAR(stated[k].real[i], (ends[1] - ends[0]) / (2 * step), 1e-7 * largest) << names[k] << " " << i;
      }
    }
    gradients_of_chunks = stated;
  }
}

INSTANTIATE_TEST_SUITE_P(RenderGradient, EqualSeeds, testing::Bool(),
                         [](const auto& guided) { return guided.param ? "guided" : "by_surfaces"; });

/// The layer of two walls under light = image: picture and gradients of one run, and how often ssrt was launched in it.
struct Traced {
  std::vector<std::vector<double>> values;
  long launches = 0;
};
Traced traced(RenderSpec spec, Precision precision, std::size_t keep) {
  const Tensors t = wall(6, 4, 0.4, 0.3, 2);
  Graph graph;
  Values v;
  for (const auto& [name, tensor] : t) v[name] = graph.input(name, tensor.shape);
  const Surfaces surfaces{v["albedo"], v["normal"], v["material"]};
  const Value radiance = render(graph, spec, {v["depth"], surfaces}, v["camera"], v["range"],
                                std::vector{v["image"], v["ambient"]}, image_answers)
                             .radiance;
  std::vector<Value> outputs{radiance};
  const Value slope = graph.constant(random_tensor(radiance.shape(), 9));
  for (const Value& g : gradient(std::vector{radiance}, std::vector{slope},
                                 std::vector{v["albedo"], v["normal"], v["material"], v["image"], v["ambient"]}))
    outputs.push_back(g);
  Device device = test_device(precision);
  Executor executor(compile(graph, outputs, device, {.precision = precision, .keep = keep}));
  for (const auto& [name, tensor] : t) executor.feed(name, tensor);
  device.set_profiling(true), device.reset_profile();
  executor.run(3);
  Traced result;
  for (const KernelProfile& kernel : device.profile())
    if (kernel.kernel == "light/ssrt.cl:ssrt") result.launches += kernel.launches;
  device.set_profiling(false);
  for (const Value& o : outputs) result.values.push_back(executor.fetch(o).real);
  return result;
}

// In one chunk, in chunks of 5 of the 48 pixels, and in such of one pixel and 16 of its samples.
TEST(RenderGradient, HasTheSameBitsWhereTheAdjointTracesNothing) {
  for (const Precision precision : {Precision::Single, Precision::Double})
    for (const auto& [chunk_rays, chunks] : {std::pair{1 << 18, 1}, {240, 10}, {16, 144}}) {
      const RenderSpec spec{.spp = 40, .chunk_rays = chunk_rays};
      const Traced again = traced(spec, precision, 0), kept = traced(spec, precision, std::size_t{1} << 20);
      EXPECT_EQ(kept.values, again.values);
      EXPECT_EQ(again.launches, 2 * chunks);
      EXPECT_EQ(kept.launches, chunks);
    }
}

/// One way to move what the picture depends on: a channel of an input, or all of them.
struct Move {
  std::string name, input;
  int channel;     // -1: all
  bool per_pixel;  // a pixel's value concerns that pixel of the picture alone
  double seen;     // relative error of the whole gradient that must not pass
};

// What the normal does to polished surfaces is small beside its spread.
const std::vector<Move> moves{{"albedo", "albedo", -1, true, 0.05},     {"roughness", "material", 0, true, 0.1},
                              {"metallic", "material", 1, true, 0.05},  {"normal x", "normal", 0, true, 0.4},
                              {"normal y", "normal", 1, true, 0.4},     {"normal z", "normal", 2, true, 0.4},
                              {"photograph", "image", -1, false, 0.05}, {"ambient", "ambient", -1, false, 0.05}};

/// How far every element of the input moves: to where the picture gets brighter as far as one estimate of the gradient
/// knows, so that nothing cancels.
Tensor direction_of(const Move& move, const Tensor& gradient) {
  const Shape& shape = gradient.shape;
  Tensor d = random_tensor(shape, 17, 0.5, 1.5);
  for (int n = 0; n < shape.n; ++n)
    for (int c = 0; c < shape.c; ++c)
      for (int y = 0; y < shape.h; ++y)
        for (int x = 0; x < shape.w; ++x) {
          const bool moves = move.channel < 0 || c == move.channel;
          d.at(n, c, y, x) *= moves ? (gradient.at(n, c, y, x) < 0 ? -1 : 1) : 0;
        }
  return d;
}

/// The layer under light = image with what draws the samples held fast; gradients of <cotangent, picture>.
struct GradientLayer {
  Graph graph;
  Values in;
  Value radiance;
  std::map<std::string, Value> gradients;
  std::unique_ptr<Executor> executor;

  GradientLayer(const Tensors& t, int spp, Precision precision, const Tensor* cotangent) {
    for (const auto& [name, tensor] : t) in[name] = graph.input(name, tensor.shape);
    RenderSpec spec{.spp = spp};
    spec.facing = false;  // which cells may be hit does not follow the normals: visibility is detached
    radiance = render(graph, spec, {in["depth"], {in["albedo"], in["normal"], in["material"]}}, in["camera"],
                      in["range"], std::vector{in["image"], in["ambient"]}, image_answers, {},
                      {in["s_albedo"], in["s_normal"], in["s_material"]})
                   .radiance;
    std::vector<Value> outputs{radiance};
    if (cotangent) {
      const std::vector<std::string> names{"albedo", "material", "normal", "image", "ambient"};
      std::vector<Value> wrt;
      for (const std::string& name : names) wrt.push_back(in[name]);
      outputs = gradient(std::vector{radiance}, std::vector{graph.constant(*cotangent)}, wrt);
      for (std::size_t i = 0; i < names.size(); ++i) gradients[names[i]] = outputs[i];
    }
    executor = std::make_unique<Executor>(compile(graph, outputs, test_device(precision), {.precision = precision}));
    for (const auto& [name, tensor] : t) executor->feed(name, tensor);
  }
};

/// Figures of one seed: derivatives of <cotangent, picture> along the move, then by pixel (and channel of albedo).
using Figures = std::vector<double>;

Figures figures_of_gradient(const Tensor& gradient, const Move& move, const Tensor& direction) {
  Figures f{std::inner_product(gradient.real.begin(), gradient.real.end(), direction.real.begin(), 0.0)};
  if (!move.per_pixel) return f;
  for (std::size_t i = 0; i < gradient.real.size(); ++i)
    if (direction.real[i] != 0) f.push_back(gradient.real[i]);
  return f;
}

Figures figures_of_difference(const Tensor& high, const Tensor& low, const Tensor& cotangent, const Move& move,
                              const Tensor& direction, double step) {
  const std::size_t plane = high.real.size() / 3;
  Figures of_values(high.real.size()), f{0};
  for (std::size_t i = 0; i < of_values.size(); ++i) {
    of_values[i] = cotangent.real[i] * (high.real[i] - low.real[i]) / (2 * step);
    f[0] += of_values[i];
  }
  if (!move.per_pixel) return f;
  for (std::size_t i = 0; i < direction.real.size(); ++i) {
    if (direction.real[i] == 0) continue;
    const std::size_t pixel = i % plane;
    // a channel of albedo shows in that channel of the picture, all else in the three of them
    const double change = move.input == "albedo"
                              ? of_values[i]
                              : of_values[pixel] + of_values[plane + pixel] + of_values[2 * plane + pixel];
    f.push_back(change / direction.real[i]);
  }
  return f;
}

/// Welch's test that two sets of independent values have one mean.
double p_of_equal_means(const std::vector<double>& a, const std::vector<double>& b) {
  const auto count = [](const auto& v) { return static_cast<double>(v.size()); };
  const double va = std::pow(standard_deviation(a), 2) / count(a), vb = std::pow(standard_deviation(b), 2) / count(b);
  const double freedom = (va + vb) * (va + vb) / (va * va / (count(a) - 1) + vb * vb / (count(b) - 1));
  return student_two_sided_p((mean(a) - mean(b)) / std::sqrt(va + vb), static_cast<int>(freedom));
}

// Gradients over many seeds against differences of renders with many samples at other seeds. What draws the samples
// stays where it is (detached), which moves no expectation. One false alarm in a thousand choices of seeds over all
// tests together (Bonferroni), and the seeds are fixed.
TEST(RenderGradient, IsUnbiasedOverSeeds) {
  constexpr int w = 6, h = 4, gradient_seeds = 64, gradient_spp = 512, truth_seeds = 12, truth_spp = 2048;
  constexpr double step = 1e-3;  // its error, step^2 / 6 of the third derivative, is far below all spreads
  Tensors t = wall(w, h, 0.4, 0.3);
  for (const char* name : {"albedo", "normal", "material"}) t[std::string("s_") + name] = t[name];
  const Tensor cotangent = random_tensor({1, 3, h, w}, 9, 0.5, 1.5);

  GradientLayer ours(t, gradient_spp, Precision::Single, &cotangent);
  const auto gradient_at = [&](std::size_t m) { return ours.executor->fetch(ours.gradients.at(moves[m].input)); };
  ours.executor->run(5000);
  std::vector<Tensor> directions;
  for (std::size_t m = 0; m < moves.size(); ++m) directions.push_back(direction_of(moves[m], gradient_at(m)));

  std::vector<std::vector<Figures>> stated(moves.size()), truth(moves.size());  // [move][seed]
  for (int s = 0; s < gradient_seeds; ++s) {
    ours.executor->run(static_cast<std::uint32_t>(s));
    for (std::size_t m = 0; m < moves.size(); ++m)
      stated[m].push_back(figures_of_gradient(gradient_at(m), moves[m], directions[m]));
  }
  GradientLayer reference(t, truth_spp, Precision::Double, nullptr);
  for (std::size_t m = 0; m < moves.size(); ++m) {
    const Tensor& value = t.at(moves[m].input);
    const Tensor& direction = directions[m];
    for (int s = 0; s < truth_seeds; ++s) {
      Tensor ends[2];
      for (const int side : {0, 1}) {
        Tensor moved = value;
        for (std::size_t i = 0; i < moved.real.size(); ++i) moved.real[i] += (side ? step : -step) * direction.real[i];
        reference.executor->feed(moves[m].input, moved);
        reference.executor->run(1000 + static_cast<std::uint32_t>(s));
        ends[side] = reference.executor->fetch(reference.radiance);
      }
      truth[m].push_back(figures_of_difference(ends[1], ends[0], cotangent, moves[m], direction, step));
    }
    reference.executor->feed(moves[m].input, value);
  }

  std::size_t tests = 0;
  for (const auto& of_move : stated) tests += of_move[0].size();
  ASSERT_EQ(tests, moves.size() + 8 * w * h);
  const double limit = 1e-3 / static_cast<double>(tests);
  for (std::size_t m = 0; m < moves.size(); ++m) {
    ASSERT_EQ(stated[m][0].size(), truth[m][0].size());
    for (std::size_t k = 0; k < stated[m][0].size(); ++k) {
      std::vector<double> a, b, off;
      for (const Figures& f : stated[m]) a.push_back(f[k]), off.push_back((1 + moves[m].seen) * f[k]);
      for (const Figures& f : truth[m]) b.push_back(f[k]);
      if (standard_deviation(a) == 0 && standard_deviation(b) == 0) {
        EXPECT_EQ(mean(a), mean(b)) << moves[m].name << " " << k;  // a unit normal made longer: exactly nothing
        continue;
      }
      EXPECT_GT(p_of_equal_means(a, b), limit)
          << moves[m].name << " " << k << ": " << mean(a) << " against " << mean(b);
      if (k == 0) {
        EXPECT_LT(p_of_equal_means(off, b), limit) << moves[m].name << ": the test sees nothing";
      }
    }
  }
}

}  // namespace
}  // namespace clerestory
