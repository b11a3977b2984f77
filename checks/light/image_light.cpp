// Lights without a network.
#include "host/ops/light/image_light.hpp"

#include "checks/op_case.hpp"
#include "host/ops/light/ssrt.hpp"

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
  OpCase unsure{.stem = "image_light",
                .label = "unsure_hits",
                .kernels = {"unsure_light", "unsure_share", "sum_segments", "row_sums", "picture_sums"},
                .inputs = inputs()};
  unsure.inputs["u"] = random_tensor({1, 1, kRows, 16}, 5, 0, 1);
  unsure.differentiate = {"image", "ambient"};
  unsure.build = [](Graph&, const Values& v) {
    return std::vector<Value>{image_light(v.at("image"), v.at("ambient"), v.at("hit"), v.at("u"))};
  };
  unsure.reference = [hits = hit.reference](const Tensors& t) {
    Tensor near = hits(t)[0];
    for (int p = 0; p < kRows; ++p)
      for (int s = 0; s < 16; ++s)
        for (int c = 0; c < 3; ++c) {
          const double u = t.at("u").at(0, 0, p, s);
          const double far = t.at("ambient").at(p / (kHeight * kWidth), c, 0, 0);
          near.at(0, c, p, s) += u * (far - near.at(0, c, p, s));
        }
    return std::vector<Tensor>{near};
  };
  OpCase constant{.stem = "image_light",
                  .label = "constant",
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
  // Rays of a list have nothing to do with pixels: there may be more rows than pictures have.
  OpCase listed = constant;
  listed.label = "constant_listed";
  listed.inputs["directions"] = random_tensor({1, 3, kRows + 7, 16}, 3);
  listed.reference = [](const Tensors& t) {
    Tensor radiance(Shape{1, 3, kRows + 7, 16});
    for (int p = 0; p < kRows + 7; ++p)
      for (int s = 0; s < 16; ++s)
        for (int c = 0; c < 3; ++c)
          radiance.at(0, c, p, s) = t.at("ambient").at(std::min(p / (kHeight * kWidth), kBatch - 1), c, 0, 0);
    return std::vector<Tensor>{radiance};
  };
  std::vector<OpCase> cases{hit, unsure, constant, panorama, listed};
  for (OpCase& c : cases) {
    c.roundings = 8;
    c.step = 1e-2, c.gradient_tolerance = 1e-10;   // linear: a difference is exact but for rounding
    c.gradient_roundings = 16 * kHeight * kWidth;  // an ambient sums the rays of a whole picture
  }
  return cases;
}

}  // namespace
}  // namespace clerestory
