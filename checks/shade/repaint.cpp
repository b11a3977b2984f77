// A replaced material in a photograph, by the rule of kernels/shade/repaint.cl written out for one pixel.
#include "host/ops/shade/repaint.hpp"

#include <array>
#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr double kBlack = 1e-12;
constexpr int kWidth = 19, kHeight = 11;
constexpr std::size_t kPlane = static_cast<std::size_t>(kWidth) * kHeight;

Shape shape_of(int channels) { return {1, channels, kHeight, kWidth}; }

double diffuse(const Tensors& t, const std::string& when, std::size_t c, std::size_t i) {
  return t.at(when + "albedo").real[c * kPlane + i] * (1 - t.at(when + "material").real[kPlane + i]);
}

double trusted(double gain) { return gain > 4 ? 16 / (gain * gain) : 1; }

/// Of the photograph's own light, of the grey one, of the layer's.
struct Shares {
  double channel = 1, grey = 0, layer = 0;
};

Shares shares(const Tensors& t, std::size_t c, std::size_t i) {
  const double old = diffuse(t, "old_", c, i), now = diffuse(t, "", c, i);
  if (now == 0) return {};
  double mean_square = 0;
  for (std::size_t k = 0; k < 3; ++k) mean_square += std::pow(diffuse(t, "old_", k, i), 2) / 3;
  const bool emitted = t.at("emitted").real[i] != 0;
  Shares s;
  s.channel = emitted || old <= kBlack ? 0 : trusted(now / old);
  const double grey = emitted || mean_square == 0 ? 0 : trusted(now / std::sqrt(mean_square));
  s.grey = (1 - s.channel) * grey, s.layer = 1 - s.channel - s.grey;
  return s;
}

double change_of(const Tensors& t, std::size_t c, std::size_t i) {
  const auto at = [&](const char* name, std::size_t k) { return t.at(name).real[k * kPlane + i]; };
  double products = 0, squares = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double old = diffuse(t, "old_", k, i);
    products += old * std::max(at("photo", k) - at("old_specular", k), 0.0), squares += old * old;
  }
  const double old = diffuse(t, "old_", c, i), now = diffuse(t, "", c, i);
  const double left = at("photo", c) - at("old_specular", c), specular = at("specular", c);
  const Shares s = shares(t, c, i);
  double shown = specular - std::min(std::max(-left, 0.0), specular);
  if (old > kBlack) shown += s.channel * now / old * std::max(left, 0.0);
  if (squares > 0) shown += s.grey * now * products / squares;
  shown += s.layer * std::max(at("whole", c) - specular, 0.0);
  return shown - at("photo", c);
}

/// Albedos that rise and fall by every factor, black ones and metal before and after, lamps, pixels that are not shown,
/// specular parts above the photograph.
Tensors inputs() {
  Tensors t{{"photo", random_tensor(shape_of(3), 1, 0, 2)},
            {"old_albedo", random_tensor(shape_of(3), 2, 0.02, 0.9)},
            {"old_material", random_tensor(shape_of(3), 3, 0, 0.9)},
            {"albedo", random_tensor(shape_of(3), 4, 0.02, 0.9)},
            {"material", random_tensor(shape_of(3), 5, 0, 0.9)},
            {"emitted", random_tensor(shape_of(1), 6)},
            {"shown", random_tensor(shape_of(1), 7)},
            {"old_specular", random_tensor(shape_of(3), 8, 0, 1)},
            {"specular", random_tensor(shape_of(3), 9, 0, 1)},
            {"whole", random_tensor(shape_of(3), 10, 0, 3)}};
  for (double& v : t.at("emitted").real) v = v > 0.7 ? 1 : 0;
  for (double& v : t.at("shown").real) v = v > -0.7 ? 1 : 0;
  for (std::size_t i = 0; i < kPlane; ++i) {
    if (i % 5 == 0) t.at("old_albedo").real[(i % 3) * kPlane + i] = 0;  // one channel is black
    if (i % 7 == 0)
      for (std::size_t c = 0; c < 3; ++c) t.at("old_albedo").real[c * kPlane + i] = i % 2 ? 0 : 0.03;  // all are dark
    if (i % 17 == 0) t.at("old_albedo").real[i] = i % 2 ? 1e-40 : 1e-10;  // no float's normal number; a ratio of 1e10
    if (i % 11 == 0) t.at("material").real[kPlane + i] = 1;               // metal now
    if (i % 13 == 0) t.at("old_material").real[kPlane + i] = 1;           // and before
  }
  return t;
}

Repainted repainted(const Values& v) {
  return {v.at("old_albedo"), v.at("old_material"), v.at("albedo"), v.at("material"), v.at("emitted")};
}

}  // namespace

OP_CASES(repaint) {
  OpCase change{.stem = "repaint", .label = "change", .kernels = {"repaint"}, .inputs = inputs()};
  change.build = [](Graph&, const Values& v) {
    return std::vector<Value>{
        repaint(v.at("photo"), repainted(v), v.at("shown"), {v.at("old_specular"), v.at("specular"), v.at("whole")})};
  };
  change.reference = [](const Tensors& t) {
    Tensor all(shape_of(3));
    for (std::size_t i = 0; i < kPlane; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        all.real[c * kPlane + i] = t.at("shown").real[i] != 0 ? change_of(t, c, i) : 0;
    return std::vector<Tensor>{all};
  };
  change.roundings = 32;  // some twenty operations; the ratio's square is taken of what is rounded
  change.no_gradient = "for applications, detached";

  OpCase share{.stem = "repaint", .label = "layer_share", .kernels = {"repaint_layer_share"}, .inputs = inputs()};
  share.build = [](Graph&, const Values& v) { return std::vector<Value>{repaint_layer_share(repainted(v))}; };
  share.reference = [](const Tensors& t) {
    Tensor most(shape_of(1));
    for (std::size_t i = 0; i < kPlane; ++i)
      for (std::size_t c = 0; c < 3; ++c) most.real[i] = std::max(most.real[i], shares(t, c, i).layer);
    return std::vector<Tensor>{most};
  };
  share.roundings = 32;
  share.no_gradient = "for applications, detached";
  return {change, share};
}

}  // namespace clerestory
