// Lights without a network, and the points of a depth map.
#include "host/ops/light/image_light.hpp"

#include <gtest/gtest.h>

#include "host/graph/map_chunks.hpp"
#include "host/ops/light/ssrt.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/shade/accumulate_samples.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "tests/ops/op_check.hpp"

namespace clerestory {
namespace {

constexpr int kBatch = 2, kHeight = 3, kWidth = 5, kRows = kBatch * kHeight * kWidth;

Camera camera() {
  Camera c = Camera::from_fov(kWidth, kHeight, 80.0);
  c.cx -= 0.4;
  return c;
}

/// The camera of the inputs, which are rounded to float.
Camera camera_in(const Tensors& t) {
  Camera c = camera();
  const Tensor& v = t.at("camera");
  c.fx = v.at(0, 0, 0, 0), c.fy = v.at(0, 1, 0, 0), c.cx = v.at(0, 2, 0, 0), c.cy = v.at(0, 3, 0, 0);
  return c;
}

Tensors inputs() {
  return {{"image", random_tensor({kBatch, 3, kHeight, kWidth}, 1, 0, 2)},
          {"ambient", random_tensor({kBatch, 3, 1, 1}, 2, 0, 1)},
          {"camera", camera_tensor(std::vector<Camera>(kBatch, camera()))},
          {"directions", random_tensor({1, 3, kRows, 16}, 3)},
          {"hit", random_ints({1, 1, kRows, 16}, 4, -3, kHeight * kWidth - 1)}};
}

/// Radiance of every ray; `pixel` says which the ray sees, below zero the ambient.
template <class Pixel>
std::vector<Tensor> seen(const Tensors& t, Pixel pixel) {
  Tensor radiance(Shape{1, 3, kRows, 16});
  for (int p = 0; p < kRows; ++p)
    for (int s = 0; s < 16; ++s) {
      const int n = p / (kHeight * kWidth), at = pixel(p, s);
      for (int c = 0; c < 3; ++c)
        radiance.at(0, c, p, s) =
            at < 0 ? t.at("ambient").at(n, c, 0, 0) : t.at("image").at(n, c, at / kWidth, at % kWidth);
    }
  return {radiance};
}

OP_CASES(image_light) {
  OpCase hit{.stem = "image_light",
             .label = "hits",
             .kernels = {"image_light", "sum_segments", "miss_sums", "picture_sums"},
             .inputs = inputs()};
  hit.differentiate = {"image", "ambient"};
  hit.build = [](Graph&, const Values& v) {
    return std::vector<Value>{image_light(v.at("image"), v.at("ambient"), v.at("hit"))};
  };
  hit.reference = [](const Tensors& t) {
    return seen(t, [&](int p, int s) { return t.at("hit").integer[static_cast<std::size_t>(p * 16 + s)]; });
  };
  OpCase constant{.stem = "constant_light",
                  .label = "batch",
                  .kernels = {"constant_light", "row_sums", "picture_sums"},
                  .inputs = inputs()};
  constant.differentiate = {"ambient"};
  constant.build = [](Graph&, const Values& v) {
    return std::vector<Value>{constant_light(v.at("ambient"), v.at("directions"), v.at("image"))};
  };
  constant.reference = [](const Tensors& t) { return seen(t, [](int, int) { return -1; }); };
  OpCase panorama{
      .stem = "image_light", .label = "panorama", .kernels = {"project_rays", "image_light"}, .inputs = inputs()};
  panorama.differentiate = {"image", "ambient"};
  panorama.build = [](Graph&, const Values& v) {
    return std::vector<Value>{panorama_light(v.at("image"), v.at("ambient"), v.at("camera"), v.at("directions"))};
  };
  panorama.reference = [](const Tensors& t) {
    return seen(t, [&](int p, int s) {
      const Tensor& d = t.at("directions");
      const auto at = camera_in(t).project({d.at(0, 0, p, s), d.at(0, 1, p, s), d.at(0, 2, p, s)});
      if (!at || at->x < 0 || at->y < 0 || at->x >= kWidth || at->y >= kHeight) return -1;
      return static_cast<int>(at->y) * kWidth + static_cast<int>(at->x);
    });
  };
  OpCase points{.stem = "surface_points", .label = "holes", .kernels = {"surface_points"}};
  Tensor depth = random_tensor({kBatch, 1, kHeight, kWidth}, 5, 0.5, 4);
  depth.at(0, 0, 1, 2) = 0;
  points.inputs = {{"depth", depth}, {"camera", inputs().at("camera")}};
  points.build = [](Graph&, const Values& v) {
    return std::vector<Value>{surface_points(v.at("depth"), v.at("camera"))};
  };
  points.reference = [](const Tensors& t) {
    Tensor all(Shape{kBatch, 3, kHeight, kWidth});
    for (int n = 0; n < kBatch; ++n)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Vec3 point = camera_in(t).unproject(x + 0.5, y + 0.5, t.at("depth").at(n, 0, y, x));
          for (int c = 0; c < 3; ++c) all.at(n, c, y, x) = point[c];
        }
    return std::vector<Tensor>{all};
  };
  // Rays of a list have nothing to do with pixels: there may be more rows than pictures have.
  OpCase listed = constant;
  listed.label = "listed";
  listed.inputs["directions"] = random_tensor({1, 3, kRows + 7, 16}, 3);
  listed.reference = [](const Tensors& t) {
    Tensor radiance(Shape{1, 3, kRows + 7, 16});
    for (int p = 0; p < kRows + 7; ++p)
      for (int s = 0; s < 16; ++s)
        for (int c = 0; c < 3; ++c)
          radiance.at(0, c, p, s) = t.at("ambient").at(std::min(p / (kHeight * kWidth), kBatch - 1), c, 0, 0);
    return std::vector<Tensor>{radiance};
  };
  std::vector<OpCase> cases{hit, constant, panorama, points, listed};
  for (OpCase& c : cases) {
    c.roundings = 8;
    c.step = 1e-2, c.gradient_tolerance = 1e-10;   // linear: a difference is exact but for rounding
    c.gradient_roundings = 16 * kHeight * kWidth;  // an ambient sums the rays of a whole picture
  }
  cases[3].no_gradient = "origins of rays are detached";
  return cases;
}

// In chunks of pixels and of samples, rest of each tile beyond the chunk, rows of two pictures in one chunk.
TEST(ImageLight, GradientsOfChunksAddUp) {
  constexpr Shape picture{kBatch, 3, kHeight, kWidth};
  constexpr int samples = 20, chunk_pixels = 7, chunk_samples = 16;
  const Tensor cotangent = random_tensor(picture, 2);
  for (const int pixel : {-1, 3}) {  // every ray misses, every ray hits this pixel of its own picture
    Graph graph;
    const Value image = graph.input("image", picture), ambient = graph.input("ambient", {kBatch, 3, 1, 1});
    const auto body = [&](Graph& g, std::span<const Value> in) -> std::vector<ChunkOutput> {
      const Value hits = g.constant(random_ints({1, 1, chunk_pixels, chunk_samples}, 5, pixel, pixel + 1));
      const Value one = g.fill({1, 3, chunk_pixels, chunk_samples}, 1),
                  pdf = g.fill({1, 1, chunk_pixels, chunk_samples}, 1);
      const Value light = add(image_light(in[0], in[1], hits), constant_light(in[1], pdf, in[0]));
      return {{accumulate_samples(one, light, pdf, {}, {}, samples).mean}};
    };
    const ChunkDomain domain{kBatch, kHeight, kWidth, samples, chunk_pixels, chunk_samples};
    const Value mean = map_chunks(graph, domain, std::vector{image, ambient}, body)[0];
    const std::vector<Value> g =
        gradient(std::vector{mean}, std::vector{graph.constant(cotangent)}, std::vector{image, ambient});
    const std::vector<Tensor> found =
        evaluate(graph, g, test_device(Precision::Double),
                 {{"image", random_tensor(picture, 1)}, {"ambient", random_tensor({kBatch, 3, 1, 1}, 3)}},
                 {.precision = Precision::Double});
    for (int n = 0; n < kBatch; ++n)
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) sum += cotangent.at(n, c, y, x);
        // 15 sums of 20 shares of values below 1
        EXPECT_NEAR(found[1].at(n, c, 0, 0), pixel < 0 ? 2 * sum : sum, 1e-13);
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x)
            EXPECT_NEAR(found[0].at(n, c, y, x), y * kWidth + x == pixel ? sum : 0, 1e-13);
      }
  }
}

// The ambient sees every ray of a picture: a million numbers, rows of 16 one by one and the 65,536 rows with Kahan's
// compensation, so that float keeps its digits.
TEST(ImageLight, ALongSumKeepsItsDigits) {
  constexpr Shape rays{1, 3, 1 << 16, 16};
  Graph g;
  const Value ambient = g.input("ambient", {1, 3, 1, 1}), image = g.input("image", {1, 3, 256, 256});
  const Tensor cotangent = random_tensor(rays, 6, 0, 0.1);
  const Value light = constant_light(ambient, g.constant(Tensor(rays)), image);
  const Value total = gradient(std::vector{light}, std::vector{g.input("cotangent", rays)}, std::vector{ambient})[0];
  const Tensor got = evaluate(g, {total}, test_device(), {{"cotangent", cotangent}})[0];
  for (int c = 0; c < 3; ++c) {
    double sum = 0;
    for (long i = c * rays.plane(); i < (c + 1) * rays.plane(); ++i)
      sum += static_cast<float>(cotangent.real[static_cast<std::size_t>(i)]);
    // 15 roundings of half an epsilon in a row, Kahan's two, and the result's.
    EXPECT_NEAR(got.at(0, c, 0, 0), sum, (7.5 + 2 + 0.5) * 0x1p-23 * sum);
  }
}

TEST(ImageLight, RefusesWhatDoesNotFit) {
  Graph g;
  const Value image = g.input("image", {1, 3, 4, 4}), ambient = g.input("ambient", {1, 3, 1, 1});
  EXPECT_THROW(image_light(image, ambient, g.input("real", {1, 1, 16, 16})), Error);
  EXPECT_THROW(image_light(image, image, g.input("hit", {1, 1, 16, 16}, Type::Int)), Error);
  EXPECT_THROW(panorama_light(image, ambient, ambient, g.input("rays", {1, 3, 16, 16})), Error);
}

}  // namespace
}  // namespace clerestory
