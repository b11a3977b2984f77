// Grids of directions over surfaces and look-ups in them, against the map of a hemisphere in its own words.
#include "host/ops/light/direction_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "checks/light/listed_rays.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector unit(const Vector& v) {
  const double length = std::sqrt(dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

/// The basis whose first vector is e_x, or for normals that point away -e_x, turned as e_z (-e_z) is turned to the
/// normal by the shortest way: what Duff et al. 2017 give in closed form.
std::array<Vector, 3> basis_of(const Vector& n) {
  const double sign = n[2] < 0 ? -1 : 1;
  const Vector axis{0, 0, sign}, half = unit({n[0], n[1], n[2] + sign});
  const auto turned = [&](const Vector& v) {  // half a turn about `half` after half a turn about the axis
    const double along_axis = 2 * dot(v, axis);
    const Vector w{along_axis * axis[0] - v[0], along_axis * axis[1] - v[1], along_axis * axis[2] - v[2]};
    const double along = 2 * dot(w, half);
    return Vector{along * half[0] - w[0], along * half[1] - w[1], along * half[2] - w[2]};
  };
  const Vector t = turned({1, 0, 0});
  return {t, cross(n, t), n};
}

Vector normal_at(const Tensor& normal, int pixel) {
  const int w = normal.shape.w;
  Vector n{};
  for (int c = 0; c < 3; ++c) n[static_cast<std::size_t>(c)] = normal.at(0, c, pixel / w, pixel % w);
  return unit(n);
}

std::vector<Tensor> plain_directions(const Tensor& normal, int side) {
  const int plane = static_cast<int>(normal.shape.plane());
  Tensor direction({1, 3, plane, side * side});
  std::vector<int> pixel;
  for (int p = 0; p < plane; ++p) {
    const auto [t, b, n] = basis_of(normal_at(normal, p));
    for (int s = 0; s < side * side; ++s) {
      const double x = (2.0 * (s % side) + 1) / side - 1, y = (2.0 * (s / side) + 1) / side - 1;
      const Vector local = unit({(x + y) / 2, (x - y) / 2, 1 - std::max(std::abs(x), std::abs(y))});
      for (int c = 0; c < 3; ++c) {
        const auto k = static_cast<std::size_t>(c);
        direction.at(0, c, p, s) = -(local[0] * t[k] + local[1] * b[k] + local[2] * n[k]);
      }
      pixel.push_back(p);
    }
  }
  return {direction, Tensor::of_int({1, 1, plane, side * side}, std::move(pixel))};
}

Tensor plain_look_up(const Tensors& inputs, const std::vector<int>& list) {
  const Tensor &grid = inputs.at("grid"), &direction = inputs.at("direction");
  const int side = static_cast<int>(std::lround(std::sqrt(grid.shape.w)));
  Tensor y({1, grid.shape.c, direction.shape.h, direction.shape.w});
  for (int ray = 0; ray < direction.shape.plane(); ++ray) {
    const int p = ray / direction.shape.w, s = ray % direction.shape.w;
    const int pixel = inputs.at("hit").integer[static_cast<std::size_t>(ray)];
    if (pixel < 0 || (!list.empty() && std::ranges::find(list, ray) == list.end())) continue;
    const auto [t, b, n] = basis_of(normal_at(inputs.at("normal"), pixel));
    const Vector back{-direction.at(0, 0, p, s), -direction.at(0, 1, p, s), -direction.at(0, 2, p, s)};
    const double a = dot(t, back), o = dot(b, back), up = std::max(dot(n, back), 0.0);
    const double norm = std::abs(a) + std::abs(o) + up;
    const auto place = [&](double e) {  // cell and how far into it
      const double x = std::clamp(((norm > 0 ? e / norm : 0) + 1) / 2 * side - 0.5, 0.0, side - 1.0);
      const int cell = std::min(static_cast<int>(x), side - 2);
      return std::pair{cell, x - cell};
    };
    const auto [i, right] = place(a + o);
    const auto [j, down] = place(a - o);
    for (int c = 0; c < grid.shape.c; ++c) {
      const auto value = [&](int x, int z) { return grid.at(0, c, pixel, z * side + x); };
      y.at(0, c, p, s) = (1 - down) * ((1 - right) * value(i, j) + right * value(i + 1, j)) +
                         down * ((1 - right) * value(i, j + 1) + right * value(i + 1, j + 1));
    }
  }
  return y;
}

OpCase directions_case(const std::string& label, const Tensor& normal, int side) {
  OpCase c{.stem = "direction_grid", .label = label, .kernels = {"grid_directions"}, .inputs = {{"normal", normal}}};
  c.build = [=](Graph&, const Values& v) {
    const GridRays rays = grid_directions(v.at("normal"), side);
    return std::vector{rays.direction, rays.pixel};
  };
  c.reference = [=](const Tensors& t) { return plain_directions(t.at("normal"), side); };
  // Two unit vectors of six operations each, three products; the basis divides by 1 + |n.z|, at least 1.
  c.roundings = 24, c.magnitude = 1;
  c.no_gradient = "for inference: throws";
  return c;
}

OpCase look_up_case(const std::string& label, Tensors inputs, const std::vector<int>& list = {}) {
  OpCase c{.stem = "direction_grid", .label = label, .kernels = {"look_up_grid"}, .inputs = std::move(inputs)};
  const Shape rays = c.inputs.at("direction").shape;
  const double side = std::sqrt(c.inputs.at("grid").shape.w);
  c.build = [=](Graph& g, const Values& v) {
    const RayList rays_of = list.empty() ? RayList{} : list_of(g, list, rays);
    return std::vector{look_up_grid(v.at("grid"), v.at("normal"), v.at("hit"), v.at("direction"), rays_of)};
  };
  c.reference = [=](const Tensors& t) { return std::vector{plain_look_up(t, list)}; };
  // A place of twenty roundings among `side` points, between answers that differ by two at most, both ways.
  c.roundings = 4 * 20 * side, c.magnitude = 1;
  c.no_gradient = "for inference: throws";
  return c;
}

/// Rays from all sides, from below the horizon too, some of which hit nothing.
Tensors look_up_inputs(const Shape& picture, const Shape& rays, int side) {
  const int plane = static_cast<int>(picture.plane());
  return {{"grid", random_tensor({1, 3, plane, side * side}, 1)},
          {"normal", random_tensor({1, 3, picture.h, picture.w}, 2)},
          {"hit", random_ints({1, 1, rays.h, rays.w}, 3, -1, plane)},
          {"direction", random_tensor({1, 3, rays.h, rays.w}, 4)}};
}

OP_CASES(direction_grid) {
  Tensor axes({1, 3, 2, 3});  // along the axes, where the basis turns over
  for (int k = 0; k < 6; ++k) axes.at(0, k % 3, k / 3, k % 3) = k < 3 ? 1 : -1;
  Tensors straight = look_up_inputs({1, 1, 2, 3}, {1, 1, 6, 16}, 8), misses = straight;
  straight["normal"] = axes;
  for (int p = 0; p < 6; ++p)  // from the zenith and level: on grid points and edges; and from nearly straight below
    for (int s = 0; s < 16; ++s) {
      straight["hit"].integer[static_cast<std::size_t>(16 * p + s)] = p;
      for (int c = 0; c < 3; ++c) straight["direction"].at(0, c, p, s) = c == s % 3 ? (s < 8 ? 1 : -1) : 0;
      if (s % 3 == p % 3 && (s < 8) == (p < 3)) straight["direction"].at(0, (s + 1) % 3, p, s) = 0.25;
    }
  for (int& pixel : misses["hit"].integer) pixel = -1;
  Tensor lengths = random_tensor({1, 3, 5, 7}, 6);  // squares of which over- and underflow in float
  for (std::size_t i = 0; i < lengths.real.size(); ++i) lengths.real[i] *= i % 35 % 2 == 0 ? 0x1p80 : 0x1p-80;
  return {directions_case("directions", random_tensor({1, 3, 5, 7}, 5), 8),
          directions_case("directions_of_axes", axes, 4),
          directions_case("directions_of_lengths", lengths, 4),
          look_up_case("look_up", look_up_inputs({1, 1, 5, 7}, {1, 1, 9, 32}, 8)),
          look_up_case("look_up_coarse", look_up_inputs({1, 1, 3, 4}, {1, 1, 5, 16}, 4)),
          look_up_case("look_up_listed", look_up_inputs({1, 1, 5, 7}, {1, 1, 7, 16}, 12), every(3, 112)),
          look_up_case("look_up_straight", straight),
          look_up_case("look_up_misses", misses)};
}

}  // namespace
}  // namespace clerestory
