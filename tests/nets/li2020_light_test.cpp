// The light of Li et al. 2020 as a light: their layer's fixed grid beside Monte Carlo, their scales by definition,
// steps of training, and a scene asked for it.
#include "nets/li2020_light.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "nets/light_training.hpp"
#include "nets/scene_light.hpp"
#include "nets/scene_radiance.hpp"
#include "tests/nets/corner.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr int kSide = 64, kCells = kSide / 2;
const Li2020LightSize kNarrow{{16, 16}, {16, 16, 16, 16, 16, 16}, {16, 16, 16, 16, 16, 16}, 12};

Tensor between(const std::string& name, const Shape& shape, double low, double high) {
  Tensor t = formula(name, shape);
  for (double& x : t.real) x = low + (high - low) * (x + 0.5);
  return t;
}

/// `count` pictures of a rough wall two metres away that is bent a little.
std::map<std::string, Tensor> wall(int count, int side) {
  std::map<std::string, Tensor> feeds;
  feeds["albedo"] = between("albedo", {count, 3, side, side}, 0.2, 0.8);
  Tensor& normal = feeds["normal"] = between("normal", {count, 3, side, side}, -0.3, 0.3);
  Tensor& material = feeds["material"] = Tensor(Shape{count, 3, side, side});
  for (int n = 0; n < count; ++n)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) normal.at(n, 2, y, x) = 1, material.at(n, 0, y, x) = 0.6;
  feeds["depth"] = Tensor(Shape{count, 1, side, side}, 2.0), feeds["range"] = Tensor(Shape{count, 3, 1, 1}, 2.0);
  feeds["image"] = between("image", {count, 3, side, side}, 0, 1);
  const std::vector<Camera> cameras(static_cast<std::size_t>(count), Camera::from_fov(side, side, 57));
  feeds["camera"] = camera_tensor(cameras);
  return feeds;
}

/// The wall's light: twelve lobes of any axis, no narrower than a grid of 8 x 16 can hold.
Gaussians twelve_lobes(Graph& graph, double sharpest) {
  Tensor axis = between("axis", {1, 36, kCells, kCells}, -1, 1);
  for (int k = 0; k < 12; ++k)
    for (int y = 0; y < kCells; ++y)
      for (int x = 0; x < kCells; ++x) {
        double square = 0;
        for (int c = 0; c < 3; ++c) square += std::pow(axis.at(0, 3 * k + c, y, x), 2);
        for (int c = 0; c < 3; ++c) axis.at(0, 3 * k + c, y, x) /= std::sqrt(square);
      }
  return {graph.constant(axis), graph.constant(between("sharpness", {1, 12, kCells, kCells}, 0, sharpest)),
          graph.constant(between("weight", {1, 36, kCells, kCells}, 0, 2))};
}

/// The same light of a row of rays a cell by `samples` of Monte Carlo.
Value by_monte_carlo(const Gaussians& lobes, const LightInputs& p, int samples) {
  const BrdfSamples drawn = sample_brdf(p.depth, p.camera, p.surfaces, p.surfaces, kCells * kCells, samples,
                                        {.brdf = BrdfModel::Li2020, .lobes = true});
  const auto rows = [](Value map) { return reshape(map, {1, map.shape().c, kCells * kCells, 1}); };
  const Value light =
      spherical_gaussians({rows(lobes.axis), rows(lobes.sharpness), rows(lobes.weight)}, drawn.direction);
  return accumulate_samples(drawn.weight, light, drawn.pdf, {}, {}, samples).mean;
}

/// Root mean square of relative differences.
double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a[i] / b[i] - 1, 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// Each cell has one pixel's surface: of a picture as large as the grid of cells. Their middle rule over elevation
// overestimates the cosine lobe by (pi/16) / sin(pi/16), 0.65 %; lobes and specular add curvature.
TEST(Li2020Light, GridIsMonteCarloWhereBothHaveConverged) {
  Graph graph;
  std::map<std::string, Tensor> large = wall(1, kSide);
  for (auto& [name, t] : large)  // cells of four equal pixels
    if (t.shape.h == kSide)
      for (int c = 0; c < t.shape.c; ++c)
        for (int y = 0; y < kSide; ++y)
          for (int x = 0; x < kSide; ++x) t.at(0, c, y, x) = t.at(0, c, y / 2 * 2, x / 2 * 2);
  std::map<std::string, Tensor> small = large;
  for (auto& [name, t] : small)
    if (t.shape.h == kSide) {
      Tensor cells(Shape{1, t.shape.c, kCells, kCells});
      for (int c = 0; c < t.shape.c; ++c)
        for (int y = 0; y < kCells; ++y)
          for (int x = 0; x < kCells; ++x) cells.at(0, c, y, x) = t.at(0, c, 2 * y, 2 * x);
      t = cells;
    }
  const Camera camera = Camera::from_fov(kCells, kCells, 57);
  small["camera"] = camera_tensor(std::span(&camera, 1));
  const auto inputs = [&](const std::map<std::string, Tensor>& of) {
    const auto value = [&](const char* name) { return graph.constant(of.at(name)); };
    return LightInputs{value("image"),
                       value("depth"),
                       {value("albedo"), value("normal"), value("material")},
                       value("camera"),
                       value("range")};
  };
  const Gaussians lobes = twelve_lobes(graph, 3);
  const Li2020Shaded grid = li2020_shaded(lobes, inputs(large));
  const std::vector<Tensor> results = evaluate(graph,
                                               {grid.diffuse, grid.specular, by_monte_carlo(lobes, inputs(small), 1024),
                                                by_monte_carlo(lobes, inputs(small), 256)},
                                               Device::open(), {}, {}, 5);
  std::vector<double> both = results[0].real;
  for (std::size_t i = 0; i < both.size(); ++i) both[i] += results[1].real[i];
  const double noise = apart(results[3].real, results[2].real);  // that of 256 samples; of 1024 it is below half
  EXPECT_LT(noise, 0.01);
  EXPECT_LT(apart(both, results[2].real), 0.015);
  EXPECT_NEAR(mean(both) / mean(results[2].real), 1, 0.01);
  EXPECT_GT(mean(results[1].real) / mean(both), 0.02);  // there is a specular part
}

TEST(Li2020Light, ScalesAreTheirs) {
  const Shape picture{1, 3, 5, 7};
  const Tensor diffuse = between("diffuse", picture, 0, 1), image = between("seen", picture, 0, 1.2);
  const auto by_hand = [&](const Tensor& specular) {
    double dd = 0, ss = 0, ds = 0, dy = 0, sy = 0;
    for (std::size_t i = 0; i < image.real.size(); ++i) {
      if (image.real[i] > 0.9) continue;
      const double d = diffuse.real[i], s = specular.real[i], y = image.real[i];
      dd += d * d, ss += s * s, ds += d * s, dy += d * y, sy += s * y;
    }
    const double determinant = dd * ss - ds * ds;
    const bool told_apart = determinant / static_cast<double>(image.real.size()) > 0.01;
    const auto within = [](double x) { return std::clamp(x, 0.0, 1000.0); };
    const double a = told_apart ? within((dy * ss - sy * ds) / determinant) : dy / dd;
    const double b = told_apart ? within((sy * dd - dy * ds) / determinant) : 0;
    double product = 0, square = 0;
    for (std::size_t i = 0; i < image.real.size(); ++i) {
      const double shown = std::clamp(a * diffuse.real[i] + b * specular.real[i], 0.0, 1.0);
      product += shown * image.real[i], square += shown * shown;
    }
    return std::array{a * product / square, b * product / square, told_apart ? 1.0 : 0.0};
  };
  const auto check = [&](const Tensor& specular, bool told_apart) {
    Graph graph;
    const Li2020Shaded scaled =
        li2020_rescaled({graph.constant(diffuse), graph.constant(specular)}, graph.constant(image));
    const std::vector<Tensor> results = evaluate(graph, {scaled.diffuse, scaled.specular},
                                                 device_for(Precision::Double), {}, {.precision = Precision::Double});
    const auto wanted = by_hand(specular);
    EXPECT_EQ(wanted[2] > 0, told_apart);
    for (std::size_t i = 0; i < image.real.size(); ++i) {
      EXPECT_NEAR(results[0].real[i], wanted[0] * diffuse.real[i], 1e-11);  // the determinant is a difference
      EXPECT_NEAR(results[1].real[i], wanted[1] * specular.real[i], 1e-11);
    }
  };
  check(between("specular", picture, 0, 1), true);
  Tensor alike = diffuse;  // as much of one as of the other: nothing tells them apart
  for (double& x : alike.real) x *= 0.25;
  check(alike, false);
}

LightSizes narrow() {
  LightSizes sizes = light_sizes("compact");
  sizes.li2020 = kNarrow;
  return sizes;
}

// Light from above, bright on one side, along directions of points on the wall.
TEST(Li2020Light, StepsLowerBothTerms) {
  LightTrainingOptions options{.batch = 2,
                               .height = kSide,
                               .width = kSide,
                               .rows = 16,
                               .samples = 32,
                               .shade_height = 0,
                               .shade_width = 0,
                               .weights = {.mixed = 1, .out_of_view = 0, .rerender = 1}};
  std::map<std::string, Tensor> feeds = wall(2, kSide);
  feeds["image"] = feeds["albedo"];
  for (const char* b : {"0", "1"}) {
    const Shape rays{1, 3, 16, 32}, one{1, 1, 16, 32};
    Tensor points = between("points", rays, -0.9, 0.9), directions = between("directions", rays, -1, 1), light(rays);
    for (int p = 0; p < 16; ++p)
      for (int s = 0; s < 32; ++s) {
        points.at(0, 2, p, s) = -2, directions.at(0, 2, p, s) = std::abs(directions.at(0, 2, p, s)) + 0.1;
        double square = 0;
        for (int c = 0; c < 3; ++c) square += std::pow(directions.at(0, c, p, s), 2);
        for (int c = 0; c < 3; ++c) directions.at(0, c, p, s) /= std::sqrt(square);
        for (int c = 0; c < 3; ++c) light.at(0, c, p, s) = std::exp(3 * directions.at(0, 0, p, s));
      }
    const std::string at = b;
    feeds["points" + at] = points, feeds["directions" + at] = directions, feeds["light" + at] = light;
    feeds["known" + at] = Tensor(one, 1), feeds["skip" + at] = Tensor::of_int(one, std::vector<int>(16 * 32, -1));
  }
  feeds["learning_rate"] = Tensor({}, 2e-3);
  Graph graph;
  const LightTraining training = light_training(graph, narrow(), options);
  std::vector<Value> outputs;
  for (const auto& [name, value] : training.losses) outputs.push_back(value);
  const Device device = Device::open();
  const auto states = std::make_shared<States>(device);
  states->initialise(graph, 7);
  Executor executor(compile(graph, outputs, device, {}, true), states);
  for (const auto& [name, tensor] : feeds) executor.feed(name, tensor);
  std::map<std::string, double> first, last;
  for (int i = 1; i <= 30; ++i) {
    executor.feed("step", Tensor({}, i));
    executor.run(static_cast<std::uint32_t>(i));
    for (const auto& [name, value] : training.losses) (i == 1 ? first : last)[name] = executor.fetch(value).real[0];
  }
  EXPECT_EQ(training.losses.size(), 3u);
  for (const auto& [name, value] : first) {
    EXPECT_GT(value, 0) << name;
    EXPECT_LT(last.at(name), 0.7 * value) << name << " was not trained";
  }
  options.weights.out_of_view = 1;
  Graph other;
  EXPECT_THROW(light_training(other, narrow(), options), Error) << "it has no part out of view";
}

std::shared_ptr<LightNets> untrained(const LightSizes& sizes) {
  const auto nets = std::make_shared<LightNets>();
  nets->sizes = sizes, nets->longer_side = 96, nets->note = "untrained";
  nets->states = std::make_shared<States>(Device::open());
  Graph graph;
  const Shape rays{1, 3, 1, 16};
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 64, 64), sizes, false)[0];
  ask_light(graph, picture, sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  nets->states->initialise(graph, 7);
  return nets;
}

RenderSettings asking(const std::string& light, std::shared_ptr<const LightNets> nets) {
  RenderSettings settings;
  settings.light = light, settings.nets = std::move(nets), settings.spp = 64;
  return settings;
}

// As bright as the photograph over its surfaces, and everywhere the light of the pixel that a point is seen at.
TEST(Li2020Light, LightsAScene) {
  Device device = Device::open();
  Scene scene = corner();
  for (float& v : scene.photo.data) v = std::min(v, 0.6f);  // nothing saturates
  const RenderSettings settings = asking("li2020", untrained(narrow()));
  const Rendering r = render_scene(device, scene, settings);
  double ours = 0, seen = 0;
  for (std::size_t i = 0; i < r.radiance.data.size(); ++i)
    if (r.radiance.data[i] > 0) ours += r.radiance.data[i], seen += scene.photo.data[i];
  EXPECT_GT(ours / seen, 0.5);  // their surfaces know no metal, and no two pictures of noise are alike
  EXPECT_LT(ours / seen, 2);

  SceneRadiance radiance(device, scene, settings, 64);
  const Vec3 on_axis = scene.camera.unproject(13.2, 20.5, 1);
  Rays rays;
  for (const double distance : {0.5, 1.0, 3.0})  // one pixel, three points
    rays.points.push_back(distance * on_axis), rays.directions.push_back({0.36, 0.48, 0.8});
  rays.points.push_back(scene.camera.unproject(30.5, 4.5, 1)), rays.directions.push_back({0.36, 0.48, 0.8});
  const RadianceAnswers answers = radiance.radiance(rays);
  for (std::size_t c = 0; c < 3; ++c) {
    const float* of = answers.radiance.data() + 4 * c;
    EXPECT_GT(of[0], 0);
    EXPECT_EQ(of[0], of[1]);
    EXPECT_EQ(of[0], of[2]);
    EXPECT_NE(of[0], of[3]);
  }
}

TEST(Li2020Light, RefusesWeightsOfAnotherMethod) {
  Device device = Device::open();
  const Scene scene = corner();
  EXPECT_THROW(render_scene(device, scene, asking("net", untrained(narrow()))), Error);
  EXPECT_THROW(render_scene(device, scene, asking("out_of_view", untrained(narrow()))), Error);
  LightSizes ours = narrow();
  ours.li2020.reset();
  EXPECT_THROW(render_scene(device, scene, asking("li2020", untrained(ours))), Error);
}

}  // namespace
}  // namespace clerestory
