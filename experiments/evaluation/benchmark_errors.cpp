#include "experiments/evaluation/benchmark_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/error.hpp"
#include "host/math/statistics.hpp"
#include "host/math/vec.hpp"

namespace clerestory {
namespace {

void check_sizes(const Image& a, const Image& b, int channels) {
  if (a.width != b.width || a.height != b.height || a.channels != channels || b.channels != channels)
    throw Error(ErrorKind::Failed, "maps to compare differ in size", "benchmark errors",
                fmt::format("{}x{}x{}", a.width, a.height, a.channels),
                fmt::format("{}x{}x{}", b.width, b.height, channels));
}

Vec3 vector_at(const Image& image, std::size_t i) { return {image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]}; }

double angle(const Vec3& predicted, const Vec3& truth, Lengths lengths) {
  const Vec3 n = glm::normalize(truth);
  if (lengths == Lengths::AsTheyAre) return std::acos(std::clamp(glm::dot(predicted, n), -1.0, 1.0));
  if (glm::length(predicted) == 0) return std::numbers::pi / 2;
  return std::atan2(glm::length(glm::cross(predicted, n)), glm::dot(predicted, n));
}

}  // namespace

std::optional<AngleErrors> normal_angles(const Image& predicted, const Image& truth, const Image& mask,
                                         Lengths lengths) {
  check_sizes(predicted, truth, 3), check_sizes(mask, mask, 1);
  std::vector<double> angles;
  for (std::size_t i = 0; i < mask.data.size(); ++i)
    if (mask.data[i] > 0.5f)
      angles.push_back(180 / std::numbers::pi * angle(vector_at(predicted, i), vector_at(truth, i), lengths));
  if (angles.empty()) return std::nullopt;
  return AngleErrors{mean(std::span<const double>(angles)), median(std::span<const double>(angles))};
}

std::optional<double> centred_log_error(const Image& predicted, const Image& truth) {
  check_sizes(predicted, truth, 1);
  std::vector<double> differences;  // of all pixels that have a depth
  std::vector<std::size_t> judged;  // of those
  for (std::size_t i = 0; i < truth.data.size(); ++i) {
    if (!(truth.data[i] > 0)) continue;
    if (truth.data[i] > kNearestJudged && truth.data[i] < kFarthestJudged) judged.push_back(differences.size());
    differences.push_back(std::log(std::max<double>(predicted.data[i], 0) + 1e-20) - std::log(truth.data[i]));
  }
  if (judged.empty()) return std::nullopt;
  const double centre = mean(std::span<const double>(differences));  // the difference of both means
  CompensatedSum squares;
  for (const std::size_t i : judged) squares.add(std::pow(differences[i] - centre, 2));
  return squares.value() / static_cast<double>(judged.size());
}

std::optional<double> masked_mse(const Image& predicted, const Image& truth, const Image& mask) {
  check_sizes(predicted, truth, truth.channels), check_sizes(mask, mask, 1);
  CompensatedSum squares;
  double values = 0;
  for (int c = 0; c < truth.channels; ++c)
    for (std::size_t i = 0; i < mask.data.size(); ++i)
      if (mask.data[i] > 0.5f)
        squares.add(std::pow(static_cast<double>(predicted.plane(c)[i]) - truth.plane(c)[i], 2)), ++values;
  if (values == 0) return std::nullopt;
  return squares.value() / values;
}

double fitted_scale(const Image& predicted, const Image& truth, const Image& mask) {
  check_sizes(predicted, truth, truth.channels), check_sizes(mask, mask, 1);
  CompensatedSum cross, square;
  for (int c = 0; c < truth.channels; ++c)
    for (std::size_t i = 0; i < mask.data.size(); ++i) {
      if (!(mask.data[i] > 0.5f)) continue;
      const double p = predicted.plane(c)[i];
      cross.add(p * truth.plane(c)[i]), square.add(p * p);
    }
  return std::clamp(cross.value() / std::max(square.value(), 1e-5), 0.001, 1000.0);
}

std::optional<double> scaled_log_depth_error(const Image& predicted, const Image& truth, const Image& mask) {
  const double scale = fitted_scale(predicted, truth, mask);
  Image ours = predicted, theirs = truth;
  for (float& v : ours.data) v = static_cast<float>(std::log1p(std::max(0.0, scale * v)));
  for (float& v : theirs.data) v = std::log1p(v);
  return masked_mse(ours, theirs, mask);
}

double psnr(const Image& predicted, const Image& truth) {
  return -10 * std::log10(*masked_mse(predicted, truth, Image(truth.width, truth.height, 1, 1.0f)));
}

namespace {

constexpr int kWindow = 11, kReach = kWindow / 2;
using Window = std::array<double, kWindow>;

Window gaussian_window() {
  Window window;
  for (int i = 0; i < kWindow; ++i)
    window[static_cast<std::size_t>(i)] = std::exp(-std::pow((i - kReach) / 1.5, 2) / 2);
  double total = 0;
  for (const double w : window) total += w;
  for (double& w : window) w /= total;
  return window;
}

/// A plane of doubles.
struct Plane {
  int width = 0, height = 0;
  std::vector<double> data;
  Plane(int w, int h) : width(w), height(h), data(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  double& at(int y, int x) { return data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x]; }
  double at(int y, int x) const { return data[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x]; }
};

/// Window means at the places where the window lies inside.
Plane blurred(const Plane& from, const Window& window) {
  Plane rows(from.width - kWindow + 1, from.height), out(rows.width, from.height - kWindow + 1);
  for (int y = 0; y < rows.height; ++y)
    for (int x = 0; x < rows.width; ++x)
      for (int k = 0; k < kWindow; ++k) rows.at(y, x) += window[static_cast<std::size_t>(k)] * from.at(y, x + k);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int k = 0; k < kWindow; ++k) out.at(y, x) += window[static_cast<std::size_t>(k)] * rows.at(y + k, x);
  return out;
}

/// Grown by the window's reach on all sides.
Image mirrored(const Image& image) {
  Image out(image.width + 2 * kReach, image.height + 2 * kReach, image.channels);
  const auto inside = [](int at, int size) { return at < 0 ? -at : at >= size ? 2 * (size - 1) - at : at; };
  for (int c = 0; c < out.channels; ++c)
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x)
        out.at(c, y, x) = image.at(c, inside(y - kReach, image.height), inside(x - kReach, image.width));
  return out;
}

Plane product(const Image& a, const Image& b, int channel) {
  Plane out(a.width, a.height);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = static_cast<double>(a.plane(channel)[i]) * b.plane(channel)[i];
  return out;
}

}  // namespace

double ssim(const Image& predicted, const Image& truth, Border border) {
  check_sizes(predicted, truth, truth.channels);
  if (truth.width < kWindow || truth.height < kWindow)
    throw usage_error("too small for structural similarity", "picture", fmt::format("{}x{}", truth.width, truth.height),
                      fmt::format("{0}x{0} at least", kWindow));
  if (border == Border::Mirrored) return ssim(mirrored(predicted), mirrored(truth), Border::LeftOut);
  const Window window = gaussian_window();
  const Image ones(truth.width, truth.height, truth.channels, 1.0f);
  constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;
  CompensatedSum total;
  double places = 0;
  for (int c = 0; c < truth.channels; ++c) {
    const auto of = [&](const Image& a, const Image& b) { return blurred(product(a, b, c), window).data; };
    const auto mx = of(predicted, ones), my = of(truth, ones), xx = of(predicted, predicted), yy = of(truth, truth),
               xy = of(predicted, truth);
    for (std::size_t i = 0; i < mx.size(); ++i) {
      const double vx = std::max(0.0, xx[i] - mx[i] * mx[i]), vy = std::max(0.0, yy[i] - my[i] * my[i]),
                   covariance = xy[i] - mx[i] * my[i];
      total.add((2 * mx[i] * my[i] + c1) * (2 * covariance + c2) /
                ((mx[i] * mx[i] + my[i] * my[i] + c1) * (vx + vy + c2)));
    }
    places += static_cast<double>(mx.size());
  }
  return total.value() / places;
}

}  // namespace clerestory
