#include "nets/light_shells.hpp"

#include <array>
#include <cmath>

#include "host/math/panorama.hpp"
#include "host/math/radiance.hpp"
#include "host/ops/light/composite.hpp"
#include "host/ops/light/gather_rays.hpp"
#include "host/ops/light/project_rays.hpp"
#include "host/ops/light/rescale_hits.hpp"
#include "host/ops/light/shells.hpp"
#include "host/ops/nn/activation.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/reduce.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/resize.hpp"
#include "host/ops/tensor/slice.hpp"
#include "nets/in_view.hpp"

namespace clerestory {
namespace {

constexpr int kGroup = 16;           // channels that are normalised together
constexpr int kPlaceNumbers = 15;    // with the flag a multiple of 16
constexpr double kMostExponent = 7;  // radiance of a texel stays below e^7, a thousand times white
constexpr double kOpaque = 1e3;      // optical depth of the outermost sphere: nothing passes in any precision

Value conv_group(const Scope& scope, Value x, int out, int stride) {
  const Value y = conv_layer(scope / "conv", x, out, 3, stride, 1);
  return group_norm_relu_layer(scope / "norm", y, out / kGroup);
}

Tensor panorama_directions(int rows, int columns) {
  Tensor t(Shape{1, 3, rows, columns});
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const Vec3 d = panorama_direction(x, y, columns, rows);
      for (int c = 0; c < 3; ++c) t.at(0, c, y, x) = d[c];
    }
  return t;
}

Value stack(const std::vector<Value>& pictures) {
  Shape s = pictures[0].shape();
  if (pictures.size() == 1) return pictures[0];
  s.n = static_cast<int>(pictures.size());
  return reshape(concat(pictures), s);
}

/// `maps` {n, C, h, w} of the photographs, seen from the camera: {n, C, rows, columns}, 0 where they do not look.
Value laid_out(Value maps, Value cameras, const Shape& picture, const ShellsSize& size) {
  const Value directions = maps.graph().constant(panorama_directions(size.rows, size.columns));
  const std::vector<Value> own = items_of(maps), camera = items_of(cameras);
  std::vector<Value> pictures;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Value hit = rescale_hits(project_rays(directions, camera[i], picture), picture, maps.shape());
    pictures.push_back(gather_rays(own[i], hit));
  }
  return stack(pictures);
}

/// A layer from the whole coarsest level to itself: what is behind the viewer depends on what is before.
Value across(const Scope& scope, Value x, Value seen, int code) {
  const Shape s = x.shape();
  const int all = s.c * static_cast<int>(s.plane());
  const Value flat = reshape(x, {s.n, all, 1, 1});
  const Value hidden = relu(conv_bias_layer(scope / "in", concat(std::array{flat, seen}), code, 1, 1, 0));
  return add(x, reshape(conv_bias_layer(scope / "out", hidden, all, 1, 1, 0), s));
}

/// Numbers of each place on the sphere, trained: above is not below.
Value places(const Scope& scope, int n, int channels, int rows, int columns) {
  const Value one = scope.state("places", {1, channels, rows, columns}, Init::normal(0.1));
  return expand(one, {n, channels, rows, columns});
}

/// A U-Net over the panorama: {n, 4 count, rows, columns}.
Value completed(const Scope& scope, Value x, Value seen, const ShellsSize& size) {
  const std::size_t levels = size.channels.size();
  std::vector<Value> skips;
  x = conv_group(scope / "enter", x, size.channels[0], 1);
  for (std::size_t i = 1; i < levels; ++i) {
    skips.push_back(x);
    x = conv_group(scope / fmt::format("down{}", i), x, size.channels[i], 2);
  }
  x = across(scope / "across", x, seen, size.code);
  for (std::size_t i = levels - 1; i > 0; --i) {
    const Value skip = skips[i - 1];
    const Value wide = resize_bilinear(x, skip.shape().h, skip.shape().w);
    x = conv_group(scope / fmt::format("up{}", i), concat(std::array{wide, skip}), size.channels[i - 1], 1);
  }
  return conv_bias_layer(scope / "paint", x, 4 * size.count, 1, 1, 0);
}

/// `level` {1, 3, 1, 1}: what the numbers of radiance, which are logarithms, count from.
Value painted(Value numbers, Value level, const ShellsSize& size) {
  const Value x = reshape(numbers, {size.count, 4, size.rows, size.columns});
  const Value log = add(slice(x, 0, 3), level);
  const Value below = affine(relu(affine(log, -1, kMostExponent)), -1, kMostExponent);
  Tensor opaque(Shape{size.count, 1, 1, 1});
  opaque.real.back() = kOpaque;
  const Value density = add(activate(slice(x, 3, 1), Function::Softplus), x.graph().constant(opaque));
  return concat(std::array{activate(below, Function::Exp), density});
}

}  // namespace

std::vector<double> shell_radii(const ShellsSize& size) {
  std::vector<double> radii{size.last};
  const double ratio = size.count > 1 ? std::pow(size.last / size.first, 1.0 / (size.count - 1)) : 1;
  while (static_cast<int>(radii.size()) < size.count) radii.insert(radii.begin(), radii.front() / ratio);
  return radii;
}

std::vector<Value> light_shells(const Scope& scope, const std::vector<Value>& levels, Value image, Value cameras,
                                const ShellsSize& size) {
  const Value &fine = levels[levels.size() - 2], coarse = levels.back();
  const Shape &cells = fine.shape(), &picture = image.shape();
  const Value features = concat(std::array{fine, resize_bilinear(coarse, cells.h, cells.w)});
  const Value chosen = relu(conv_bias_layer(scope / "choose", features, size.channels[0], 1, 1, 0));
  // The photograph itself, finer than its features, and a flag of where it looks.
  const Value log = activate(affine(image, 1, kLightFloor), Function::Log);
  const Value level = plane_mean(log);
  const Value shown = subtract(resize_area(log, 2 * cells.h, 2 * cells.w), level);
  const Value flag = image.graph().fill({cells.n, 1, 2 * cells.h, 2 * cells.w}, 1);
  const Value laid = concat(std::array{laid_out(chosen, cameras, picture, size),
                                       laid_out(concat(std::array{shown, flag}), cameras, picture, size),
                                       places(scope, cells.n, kPlaceNumbers, size.rows, size.columns)});
  const Value numbers = completed(scope, laid, plane_mean(coarse), size);
  std::vector<Value> shells;
  const std::vector<Value> own = items_of(numbers), levels_of = items_of(level);
  for (std::size_t i = 0; i < own.size(); ++i) shells.push_back(painted(own[i], levels_of[i], size));
  return shells;
}

Value shells_light(Value shells, Value points, Value direction, Value range, const ShellsSize& size) {
  const ShellSamples s = look_up_shells(shells, points, direction, range, shell_radii(size));
  return composite(slice(s.value, 3, 1), slice(s.value, 0, 3), s.met).radiance;
}

}  // namespace clerestory
