#include "host/ops/light/spherical_gaussians.hpp"

#include <algorithm>
#include <cmath>

#include "checks/light/unit_tensors.hpp"
#include "checks/op_case.hpp"

namespace clerestory {
namespace {

constexpr double kSteepest = 636.6;  // tan(0.999 pi / 2)

/// Lobes of each pixel of {1, ., h, w}; sharpness low to high.
Tensors lobes_of(int count, int h, int w, double low, double high) {
  return {{"axis", unit_tensor({1, 3 * count, h, w}, 1)},
          {"sharpness", random_tensor({1, count, h, w}, 2, low, high)},
          {"weight", random_tensor({1, 3 * count, h, w}, 3, 0, 2)}};
}

/// The light of the lobes at (y, x) along ray (p, s), by the cosine and not by the chord.
double arriving(const Tensors& in, int y, int x, int p, int s, int channel) {
  const Tensor &axis = in.at("axis"), &direction = in.at("direction");
  double sum = 0;
  for (int k = 0; k < in.at("sharpness").shape.c; ++k) {
    long double dot = 0, lengths = 0;  // their difference is short of digits
    for (int c = 0; c < 3; ++c) {
      const long double a = axis.at(0, 3 * k + c, y, x), d = direction.at(0, c, p, s);
      dot += a * d, lengths += 0.5L * (a * a + d * d);  // 1 but for the rounding of inputs
    }
    const double e = in.at("sharpness").at(0, k, y, x) * static_cast<double>(dot - lengths);
    if (e > -40) sum += in.at("weight").at(0, 3 * k + channel, y, x) * std::exp(e);
  }
  return sum;
}

/// Along all rays, from the lobes at `place`(p, s).
template <class Place>
std::vector<Tensor> along_rays(const Tensors& in, const Place& place) {
  const Tensor& direction = in.at("direction");
  Tensor y(direction.shape);
  for (int p = 0; p < y.shape.h; ++p)
    for (int s = 0; s < y.shape.w; ++s) {
      if (direction.at(0, 0, p, s) == 0 && direction.at(0, 1, p, s) == 0 && direction.at(0, 2, p, s) == 0) continue;
      const auto [row, column] = place(p, s);
      for (int c = 0; c < 3; ++c) y.at(0, c, p, s) = arriving(in, row, column, p, s, c);
    }
  return {y};
}

std::vector<Tensor> of_rows(const Tensors& in) {
  const bool shared = in.at("sharpness").shape.w == 1;
  return along_rays(in, [&](int p, int s) { return std::pair{p, shared ? 0 : s}; });
}

Gaussians gaussians(const Values& v) { return {v.at("axis"), v.at("sharpness"), v.at("weight")}; }

/// An exponent e is good to some |e| epsilon, where exp(e) is left: |e| exp(e) < 0.4; then the sum over lobes.
double roundings_of(const Tensors& in) { return 6 + 2 * in.at("sharpness").shape.c; }

OpCase case_of_rows(const std::string& label, int lobes, int rows, int samples, bool shared, double low, double high) {
  OpCase c{.stem = "spherical_gaussians", .label = label};
  c.kernels = {"spherical_gaussians", "spherical_gaussians_to_direction", "spherical_gaussians_to_lobes"};
  c.inputs = lobes_of(lobes, rows, shared ? 1 : samples, low, high);
  c.inputs["direction"] = unit_tensor({1, 3, rows, samples}, 4);
  c.build = [](Graph&, const Values& v) { return std::vector{spherical_gaussians(gaussians(v), v.at("direction"))}; };
  c.reference = of_rows;
  c.roundings = roundings_of(c.inputs), c.magnitude = 2;
  c.differentiate = {"axis", "sharpness", "weight", "direction"};
  // Third derivatives are some sharpness^2 times the first, and rounding is epsilon / step.
  c.step = 1e-4 / std::max(high, 1.0);
  c.gradient_roundings = 4 * c.roundings * (shared ? std::sqrt(samples) : 1);
  return c;
}

/// No direction: nothing arrives, and nothing is to be learned from it.
OpCase none_case(const std::string& label, bool shared) {
  OpCase c = case_of_rows(label, 3, 2, 16, shared, 0, 8);
  for (int k = 0; k < 3; ++k)
    for (const int s : {1, 7}) c.inputs.at("direction").at(0, k, 0, s) = 0;
  c.kernels.erase(c.kernels.begin() + 1),
      c.differentiate = {"axis", "sharpness", "weight"};  // light sets in at once where there is a direction
  return c;
}

/// The first lobe of a row is looked straight into, the second from straight behind.
OpCase straight_case() {
  OpCase c = case_of_rows("straight", 2, 3, 16, true, 0.5 * kSteepest, kSteepest);
  for (int p = 0; p < 3; ++p)
    for (int k = 0; k < 3; ++k)
      for (int s = 2; s < 16; ++s)
        c.inputs.at("direction").at(0, k, p, s) = (s % 2 ? -1 : 1) * c.inputs.at("axis").at(0, (s % 2) * 3 + k, p, 0);
  c.gradient_tolerance = 1e-5;  // those to sharpness are next to nothing here, beside values of 2 that round
  return c;
}

constexpr Shape kGrid{1, 1, 5, 7}, kPicture{1, 1, 12, 21};

/// Around a camera of kPicture: most in view, some beside it, behind it, in its plane.
Tensor scattered(int rows, int samples) {
  Tensor points = random_tensor({1, 3, rows, samples}, 5, -1, 1);
  for (int p = 0; p < rows; ++p)
    for (int s = 0; s < samples; ++s) points.at(0, 2, p, s) -= (p + s) % 5 ? 1.5 : 0;
  for (int k = 0; k < 3; ++k) points.at(0, k, 1, 0) = 0;
  return points;
}

Tensor picture_camera() { return Tensor({1, 4, 1, 1}, std::vector<double>{18, 12, 9.75, 6}); }

/// Row and column of the cell.
std::pair<int, int> cell(const Tensors& in, int p, int s) {
  const Tensor &camera = in.at("camera"), &points = in.at("points");
  const double near = -1 / std::min(points.at(0, 2, p, s), -1e-6);
  const auto part = [](double place, int pixels, int cells) {
    return static_cast<int>(std::floor(std::clamp(place * cells / pixels, 0.0, cells - 1.0)));
  };
  return {part(camera.real[3] - camera.real[1] * near * points.at(0, 1, p, s), kPicture.h, kGrid.h),
          part(camera.real[2] + camera.real[0] * near * points.at(0, 0, p, s), kPicture.w, kGrid.w)};
}

OpCase case_of_points(const std::string& label, int rows, int samples, bool per_row) {
  OpCase c{.stem = "spherical_gaussians", .label = label, .kernels = {"gaussians_of_points"}};
  c.inputs = lobes_of(4, kGrid.h, kGrid.w, 0, 30);
  c.inputs["camera"] = picture_camera(), c.inputs["points"] = scattered(rows, per_row ? 1 : samples);
  c.inputs["direction"] = unit_tensor({1, 3, rows, samples}, 4);
  for (int k = 0; k < 3; ++k) c.inputs.at("direction").at(0, k, 0, 3) = 0;
  c.build = [](Graph&, const Values& v) {
    return std::vector{gaussians_of_points(gaussians(v), v.at("camera"), kPicture, v.at("points"), v.at("direction"))};
  };
  c.reference = [per_row](const Tensors& in) {
    return along_rays(in, [&](int p, int s) { return cell(in, p, per_row ? 0 : s); });
  };
  c.roundings = roundings_of(c.inputs), c.magnitude = 2;
  c.no_gradient = "for inference: in training rays gather the lobes of their cells";
  return c;
}

OpCase cells_case() {
  OpCase c{.stem = "spherical_gaussians", .label = "cells", .kernels = {"point_cells"}};
  c.inputs = {{"camera", picture_camera()}, {"points", scattered(9, 32)}};
  c.build = [](Graph&, const Values& v) {
    return std::vector{point_cells(v.at("points"), v.at("camera"), kPicture, kGrid)};
  };
  c.reference = [](const Tensors& in) {
    Tensor y = Tensor::of_int({1, 1, 9, 32}, std::vector<int>(9 * 32));
    for (int p = 0; p < 9; ++p)
      for (int s = 0; s < 32; ++s) {
        const auto [row, column] = cell(in, p, s);
        y.integer[static_cast<std::size_t>(p * 32 + s)] = row * kGrid.w + column;
      }
    return std::vector{y};
  };
  c.no_gradient = "cells are discrete";
  return c;
}

/// Li et al.'s frame in its own words: z = n, y the part of `up` across n, x = -(y cross n).
std::vector<Tensor> turned(const Tensors& in) {
  const Tensor &axis = in.at("axis"), &normal = in.at("normal");
  Tensor y(axis.shape);
  for (int n = 0; n < axis.shape.n; ++n)
    for (int j = 0; j < axis.shape.h; ++j)
      for (int i = 0; i < axis.shape.w; ++i) {
        Vector3 z = unit_of({normal.at(n, 0, j, i), normal.at(n, 1, j, i), normal.at(n, 2, j, i)});
        const Vector3 up = std::abs(z[1]) > 0.999 ? Vector3{0, 0, 1} : Vector3{0, 1, 0};
        const double along = up[0] * z[0] + up[1] * z[1] + up[2] * z[2];
        const Vector3 b = unit_of({up[0] - along * z[0], up[1] - along * z[1], up[2] - along * z[2]});
        const Vector3 t{b[2] * z[1] - b[1] * z[2], b[0] * z[2] - b[2] * z[0], b[1] * z[0] - b[0] * z[1]};
        for (int k = 0; 3 * k < axis.shape.c; ++k)
          for (int c = 0; c < 3; ++c) {
            const auto at = static_cast<std::size_t>(c);
            y.at(n, 3 * k + c, j, i) = axis.at(n, 3 * k, j, i) * t[at] + axis.at(n, 3 * k + 1, j, i) * b[at] +
                                       axis.at(n, 3 * k + 2, j, i) * z[at];
          }
      }
  return {y};
}

/// Normals of all lengths; straight up, down and on both sides of where `up` changes, nearly along it; none.
OpCase turn_case() {
  OpCase c{.stem = "spherical_gaussians", .label = "turn", .kernels = {"turn_gaussians"}};
  c.inputs = {{"axis", unit_tensor({2, 6, 4, 5}, 1)}, {"normal", random_tensor({2, 3, 4, 5}, 2, -3, 3)}};
  const std::vector<Vector3> special{
      {0, 1, 0}, {0, -1, 0}, {0.0439, 0.99904, 0}, {0.0456, 0.99896, 0}, {0, 0.99896, 0.0456}, {0, -0.99904, 0.0439},
      {0, 0, 0}, {0, 0, -2}};
  for (std::size_t i = 0; i < special.size(); ++i)
    for (int k = 0; k < 3; ++k)
      c.inputs.at("normal").at(0, k, static_cast<int>(i) / 5, static_cast<int>(i) % 5) =
          special[i][static_cast<std::size_t>(k)];
  c.build = [](Graph&, const Values& v) { return std::vector{turn_to_camera(v.at("axis"), v.at("normal"))}; };
  c.reference = turned;
  c.roundings = 400, c.magnitude = 1;  // the part of `up` across a normal may be 0.045 long
  c.differentiate = {"axis"}, c.step = 1, c.gradient_tolerance = 1e-12;  // linear
  return c;
}

}  // namespace

OP_CASES(spherical_gaussians) {
  return {case_of_rows("rays", 3, 3, 16, false, 0, 8),
          case_of_rows("rows", 12, 5, 48, true, 0, 8),
          case_of_rows("sharp_rays", 5, 3, 32, false, 0, kSteepest),
          case_of_rows("sharp_rows", 12, 3, 128, true, 100, kSteepest),
          case_of_rows("flat", 2, 2, 16, true, 0, 0),
          none_case("no_direction", false),
          none_case("no_direction_in_rows", true),
          straight_case(),
          case_of_points("points", 6, 32, false),
          case_of_points("points_of_rows", 11, 16, true),
          cells_case(),
          turn_case()};
}

}  // namespace clerestory
