// A photograph with objects put into it, by the rule of kernels/shade/insertion.cl written out for one value.
#include "host/ops/shade/insertion.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr int kWidth = 13, kHeight = 7;

Shape shape_of(int channels) { return {1, channels, kHeight, kWidth}; }

double plainness_of(double change, double beside) {
  const double share = std::abs(change) / std::max(beside, 1e-6);
  return std::clamp((share - 1.0 / 128) / (1.0 / 32 - 1.0 / 128), 0.0, 1.0);
}

double composite_of(double photo, double objects, double covers, double change, double without, bool emits) {
  double gain = 1;
  if (without > 0 && !emits) gain = photo / without;
  if (change > 0 && gain > 1) gain = 1;
  double p = plainness_of(change, photo);
  if (change < 0 && without > 0) p = std::max(p, plainness_of(change, without));
  return objects + (1 - covers) * std::max(0.0, photo + ((1 - p) + p * gain) * change);
}

/// Faint, middling and plain changes of either sign, layers brighter and darker than the photograph and none at all,
/// lamps, whole and half pixels of objects; black and near-black photographs.
Tensors inputs() {
  Tensors t{{"photo", random_tensor(shape_of(3), 1, 0, 2)},      {"objects", random_tensor(shape_of(3), 2, 0, 1)},
            {"covers", random_tensor(shape_of(1), 3, -1, 2)},    {"change", random_tensor(shape_of(3), 4)},
            {"without", random_tensor(shape_of(3), 5, -0.5, 3)}, {"emits", random_tensor(shape_of(1), 6)}};
  for (double& v : t.at("covers").real) v = std::clamp(v, 0.0, 1.0);
  for (double& v : t.at("without").real) v = std::max(v, 0.0);
  for (double& v : t.at("emits").real) v = v > 0.8 ? 1 : 0;
  auto& photo = t.at("photo").real;
  auto& change = t.at("change").real;
  for (std::size_t i = 0; i < change.size(); ++i) change[i] *= photo[i] * (i % 3 == 0 ? 0.01 : i % 3 == 1 ? 0.04 : 2);
  for (std::size_t i = 0; i < photo.size(); i += 17) photo[i] = i % 2 ? 0 : 1e-7;
  return t;
}

std::vector<Tensor> reference(const Tensors& t) {
  Tensor composite(shape_of(3));
  const std::size_t plane = static_cast<std::size_t>(kWidth) * kHeight;
  for (std::size_t i = 0; i < composite.real.size(); ++i)
    composite.real[i] =
        composite_of(t.at("photo").real[i], t.at("objects").real[i], t.at("covers").real[i % plane],
                     t.at("change").real[i], t.at("without").real[i], t.at("emits").real[i % plane] != 0);
  return {composite};
}

}  // namespace

OP_CASES(insertion) {
  OpCase whole{.stem = "insertion", .label = "composite", .kernels = {"insertion"}, .inputs = inputs()};
  whole.build = [](Graph&, const Values& v) {
    return std::vector<Value>{
        insertion({v.at("photo"), v.at("objects"), v.at("covers"), v.at("change"), v.at("without"), v.at("emits")})};
  };
  whole.reference = reference;
  whole.roundings = 8;
  whole.no_gradient = "for applications, detached";
  return {whole};
}

}  // namespace clerestory
