#include "host/ops/light/soft_lamps.hpp"

#include <array>
#include <cmath>

#include "checks/light/soft_lamps_rays.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using namespace soft_lamps_rays;

/// What channel c sees of lamp k. The angle itself, by atan2 of cross and dot products: another way than the kernel's
/// chord.
double seen(const Tensors& in, int p, int s, int k, int channel) {
  const Tensor &points = in.at("points"), &direction = in.at("direction"), &places = in.at("places");
  const int at = points.shape.w == 1 ? 0 : s;
  double to[3], d[3], dot = 0, r2 = 0, d2 = 0;
  for (int c = 0; c < 3; ++c) {
    to[c] = places.at(0, c, 0, k) - points.at(0, c, p, at), d[c] = direction.at(0, c, p, s);
    dot += to[c] * d[c], r2 += to[c] * to[c], d2 += d[c] * d[c];
  }
  if (d2 == 0) return 0;
  const double x = to[1] * d[2] - to[2] * d[1], y = to[2] * d[0] - to[0] * d[2], z = to[0] * d[1] - to[1] * d[0];
  const double angle = std::atan2(std::sqrt(x * x + y * y + z * z), dot), half = std::sin(angle / 2);
  const double size = places.at(0, 3, 0, k);
  const double shape = std::exp(-2 * r2 * half * half / (size * size));
  if (!in.contains("lobe")) return shape;
  const double density = in.at("lobe").at(0, 0, p, s), lobe = density > 0 ? 1 / density : INFINITY;  // solid angles
  const double share = std::min(1.0, lobe / (2 * M_PI / (2 + r2 / (size * size))));
  return shape * (1 - in.at("specular").at(0, channel, p, s) * (1 - share));
}

std::vector<Tensor> added(const Tensors& in) {
  Tensor y = in.at("radiance");
  const int lamps = in.at("places").shape.w;
  for (int p = 0; p < y.shape.h; ++p)
    for (int s = 0; s < y.shape.w; ++s)
      for (int k = 0; k < lamps; ++k)
        for (int c = 0; c < 3; ++c)
          y.at(0, c, p, s) += in.at("u").at(0, 0, p, s) * in.at("colors").at(0, c, 0, k) * seen(in, p, s, k, c);
  return {y};
}

std::vector<Tensor> weighed(const Tensors& in) {
  const Tensor& weight = in.at("weight");
  const int lamps = in.at("places").shape.w, rows = weight.shape.h;
  Tensor y(Shape{rows, 3, 1, lamps});
  for (int p = 0; p < rows; ++p)
    for (int k = 0; k < lamps; ++k)
      for (int s = 0; s < weight.shape.w; ++s)
        for (int c = 0; c < 3; ++c)
          y.at(p, c, 0, k) += weight.at(0, c, p, s) * in.at("u").at(0, 0, p, s) * seen(in, p, s, k, c);
  return {y};
}

OpCase add_case(const std::string& label, Tensors in, double roundings) {
  OpCase c{.stem = "soft_lamps", .label = label};
  c.kernels = {"add_lamps"};
  c.inputs = std::move(in);
  const Shape shape = c.inputs.at("direction").shape;
  c.inputs["radiance"] = random_tensor(shape, 6, 0, 1);
  c.inputs["colors"] = random_tensor({1, 3, 1, c.inputs.at("places").shape.w}, 7, 0, 1);
  c.build = [](Graph&, const Values& v) {
    return std::vector{add_lamps(v.at("radiance"), rays_of(v), v.at("places"), v.at("colors"))};
  };
  c.reference = added;
  c.roundings = roundings, c.magnitude = 1;
  c.differentiate = {"radiance", "colors"};
  c.step = 1, c.gradient_tolerance = 1e-11;  // linear: a difference is exact but for the rounding of its sums
  c.gradient_roundings = roundings * shape.h * shape.w;
  return c;
}

/// The exponent is -(r / size)^2 (1 - cos): its rounding is that many times a few epsilon, where the lamp is seen at
/// all.
constexpr double kRoundings = 200;

}  // namespace

OP_CASES(soft_lamps) {
  auto many = add_case("rays", rays(3, 16, 5, false, 0.3, 1.5), kRoundings);
  many.kernels.insert(many.kernels.end(), {"weigh_lamps", "add_lamps_adjoint"});
  auto rows = add_case("rows", rays(5, 32, 17, true, 0.3, 1.5), kRoundings);
  // Needle-sharp: nearly every ray misses, to 0 exactly; huge: every point lies inside.
  auto sharp = add_case("sharp", rays(4, 16, 3, false, 1e-3, 2e-3), 4 * kRoundings);
  auto huge = add_case("huge", rays(4, 16, 3, true, 1e5, 1e6), kRoundings);
  // Lobes from none to a mirror's, those that see every lamp whole among them; metal and Lambertian ones, too.
  auto lobes = add_case("lobes", rays(3, 16, 4, false, 0.3, 1.5), kRoundings);
  for (std::size_t i = 0; i < lobes.inputs.at("lobe").real.size(); ++i) {
    lobes.inputs.at("lobe").real[i] = std::array{0.0, 1e-30, 0.31, 30.0, 1e8, 1e30}[i % 6];
    lobes.inputs.at("specular").real[i] = std::array{0.0, 1.0, 0.5, 0.7, 1.0}[i % 5];
  }
  // To lobes: densities on both sides of where a lamp is cut, which differences must not step over.
  auto lobe_gradients = add_case("lobe_gradients", rays(3, 16, 4, true, 0.3, 1.5), kRoundings);
  lobe_gradients.kernels.push_back("add_lamps_adjoint");
  lobe_gradients.differentiate = {"specular", "lobe", "colors"};
  for (double& d : lobe_gradients.inputs.at("lobe").real) d = 0.5 + 3 * d;
  lobe_gradients.step = 1e-5, lobe_gradients.gradient_tolerance = 1e-8;
  // No surface asks: all of every lamp.
  auto nobody = add_case("nobody", rays(3, 16, 4, false, 0.3, 1.5), kRoundings);
  nobody.inputs.erase("lobe"), nobody.inputs.erase("specular");
  nobody.kernels.push_back("weigh_lamps");
  // In the middle of the lamp, and straight at it: a chord of 0.
  Tensors in = rays(2, 16, 2, true, 0.5, 0.6);
  for (int c = 0; c < 3; ++c) {
    in.at("places").at(0, c, 0, 0) = in.at("points").at(0, c, 0, 0);
    for (int s = 0; s < 16; ++s)
      in.at("direction").at(0, c, 1, s) = 3 * (in.at("places").at(0, c, 0, 1) - in.at("points").at(0, c, 1, 0));
  }
  auto inside = add_case("inside", std::move(in), kRoundings);

  OpCase weigh{.stem = "soft_lamps", .label = "weigh"};
  weigh.kernels = {"weigh_lamps"};
  weigh.inputs = rays(6, 32, 9, true, 0.3, 1.5);
  weigh.inputs["weight"] = random_tensor({1, 3, 6, 32}, 8, 0, 1);
  weigh.build = [](Graph&, const Values& v) {
    return std::vector{weigh_lamps(v.at("weight"), rays_of(v), v.at("places"))};
  };
  weigh.reference = weighed;
  weigh.roundings = 32 * kRoundings, weigh.magnitude = 1;
  weigh.no_gradient = "the matrix of a linear problem";
  return {many, rows, sharp, huge, lobes, lobe_gradients, nobody, inside, weigh};
}

}  // namespace clerestory
