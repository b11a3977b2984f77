#include "experiments/evaluation/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr double degrees = 180 / std::numbers::pi;

std::string size_text(const Image& i) { return fmt::format("{}x{}x{}", i.channels, i.height, i.width); }

void check_sizes(const Image& predicted, const Image& truth, const Image& mask) {
  if (predicted.width != truth.width || predicted.height != truth.height || predicted.channels != truth.channels ||
      mask.width != truth.width || mask.height != truth.height || mask.channels != 1)
    throw Error(ErrorKind::Failed, "maps to compare differ in size", "metrics",
                size_text(predicted) + " with mask " + size_text(mask), size_text(truth));
}

std::vector<std::size_t> valid_pixels(const Image& mask) {
  std::vector<std::size_t> valid;
  for (std::size_t i = 0; i < mask.data.size(); ++i)
    if (mask.data[i] > 0.5f) valid.push_back(i);
  return valid;
}

Vec3 vector_at(const Image& image, std::size_t pixel) {
  const std::size_t plane = image.pixels();
  return {image.data[pixel], image.data[plane + pixel], image.data[2 * plane + pixel]};
}

/// Angle in radians, accurate near 0 and pi where the arc cosine is not.
double angle(const Vec3& a, const Vec3& b) { return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)); }

double mean_angle_to(const Vec3& direction, const std::vector<Vec3>& normals) {
  CompensatedSum total;
  for (const Vec3& n : normals) total.add(angle(direction, n));
  return total.value() / static_cast<double>(normals.size());
}

/// One step of Weiszfeld's algorithm: the mean of the logarithms at `from`, each weighted by one over its angle.
Vec3 weiszfeld_step(const Vec3& from, const std::vector<Vec3>& normals) {
  Vec3 pull(0);
  double weight = 0;
  for (const Vec3& n : normals) {
    const double theta = angle(from, n);
    if (theta < 1e-9) continue;  // a datum at the centre pulls nowhere
    const Vec3 tangent = n - glm::dot(n, from) * from;
    const double length = glm::length(tangent);
    if (length > 1e-12) pull += tangent / length;  // log = theta * unit tangent, weighted by 1 / theta
    weight += 1 / theta;
  }
  if (weight == 0) return from;
  const Vec3 step = pull / weight;
  const double length = glm::length(step);
  if (length < 1e-12) return from;
  return glm::normalize(std::cos(length) * from + std::sin(length) * (step / length));
}

Vec3 descend(Vec3 at, const std::vector<Vec3>& normals) {
  double best = mean_angle_to(at, normals);
  for (int i = 0; i < 60; ++i) {
    const Vec3 next = weiszfeld_step(at, normals);
    const double value = mean_angle_to(next, normals);
    if (value >= best) break;
    const bool settled = best - value < 1e-7;
    at = next, best = value;
    if (settled) break;
  }
  return at;
}

/// Directions evenly on the sphere (golden-angle spiral).
Vec3 spiral(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, r = std::sqrt(std::max(0.0, 1 - z * z));
  const double phi = i * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace

std::optional<double> mean_angle(const Image& predicted, const Image& truth, const Image& mask) {
  check_sizes(predicted, truth, mask);
  const auto valid = valid_pixels(mask);
  if (valid.empty()) return std::nullopt;
  CompensatedSum total;
  for (const std::size_t i : valid) {
    const Vec3 p = vector_at(predicted, i);
    total.add(glm::length(p) > 0 ? angle(p, vector_at(truth, i)) : std::numbers::pi / 2);
  }
  return degrees * total.value() / static_cast<double>(valid.size());
}

std::optional<double> rooted_si_log(const Image& predicted, const Image& truth, const Image& mask) {
  check_sizes(predicted, truth, mask);
  const auto valid = valid_pixels(mask);
  if (valid.empty()) return std::nullopt;
  const double n = static_cast<double>(valid.size());
  std::vector<double> differences;
  differences.reserve(valid.size());
  for (const std::size_t i : valid) {
    if (!(truth.data[i] > 0))
      throw Error(ErrorKind::Failed, "a valid depth is not positive", "metrics", fmt::format("{}", truth.data[i]));
    differences.push_back(std::log(std::max<double>(predicted.data[i], least_relative_depth)) -
                          std::log(truth.data[i]));
  }
  const double mean_difference = sum(differences) / n;
  CompensatedSum squares;  // second pass: no cancellation
  for (const double d : differences) squares.add((d - mean_difference) * (d - mean_difference));
  return std::sqrt(squares.value() / n);
}

std::optional<double> scale_invariant_mse(const Image& predicted, const Image& truth, const Image& mask) {
  check_sizes(predicted, truth, mask);
  const auto valid = valid_pixels(mask);
  if (valid.empty()) return std::nullopt;
  CompensatedSum cross, square;
  for (int c = 0; c < truth.channels; ++c)
    for (const std::size_t i : valid) {
      const double p = predicted.plane(c)[i];
      cross.add(p * truth.plane(c)[i]);
      square.add(p * p);
    }
  const double scale = square.value() > 0 ? std::max(0.0, cross.value() / square.value()) : 0;
  CompensatedSum error;
  for (int c = 0; c < truth.channels; ++c)
    for (const std::size_t i : valid) {
      const double d = scale * predicted.plane(c)[i] - truth.plane(c)[i];
      error.add(d * d);
    }
  return error.value() / static_cast<double>(valid.size() * static_cast<std::size_t>(truth.channels));
}

std::optional<double> channel_mse(const Image& predicted, const Image& truth, const Image& mask, int channel) {
  check_sizes(predicted, truth, mask);
  const auto valid = valid_pixels(mask);
  if (valid.empty()) return std::nullopt;
  CompensatedSum error;
  for (const std::size_t i : valid) {
    const double d = static_cast<double>(predicted.plane(channel)[i]) - truth.plane(channel)[i];
    error.add(d * d);
  }
  return error.value() / static_cast<double>(valid.size());
}

std::optional<Vec3> best_constant_normal(const Image& truth, const Image& mask) {
  check_sizes(truth, truth, mask);
  std::vector<Vec3> normals, sparse;
  for (const std::size_t i : valid_pixels(mask)) normals.push_back(glm::normalize(vector_at(truth, i)));
  if (normals.empty()) return std::nullopt;
  const std::size_t stride = 1 + normals.size() / 400;  // the grid only has to find the right valley
  for (std::size_t i = 0; i < normals.size(); i += stride) sparse.push_back(normals[i]);

  constexpr int grid = 400;
  std::vector<std::pair<double, Vec3>> starts;
  for (int i = 0; i < grid; ++i) starts.emplace_back(mean_angle_to(spiral(i, grid), sparse), spiral(i, grid));
  std::partial_sort(starts.begin(), starts.begin() + 3, starts.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  starts.resize(3);
  Vec3 mean(0);
  for (const Vec3& n : normals) mean += n;
  if (glm::length(mean) > 1e-9) starts.emplace_back(0, glm::normalize(mean));

  Vec3 best = starts[0].second;
  double least = 10;
  for (const auto& [unused, start] : starts) {
    const Vec3 end = descend(start, normals);
    const double value = mean_angle_to(end, normals);
    if (value < least) least = value, best = end;
  }
  return best;
}

const MapErrorInfo& info(MapError error) {
  static const std::array<MapErrorInfo, map_error_count> all{{
      {"normal_degrees", "normals", "degrees", "mean angle between unit normals, camera space, over valid geometry"},
      {"depth_si_log", "depth", "rooted si-log",
       "standard deviation of ln(predicted) - ln(true) over valid geometry (natural logarithm, rooted, any one scale "
       "per image is free); predictions below 0.001 of scene_scale count as 0.001"},
      {"albedo_si_mse", "albedo", "si-MSE",
       "mean squared error of linear albedo after one least-squares scale per image (not per channel), over valid "
       "geometry that does not emit"},
      {"roughness_mse", "roughness", "MSE", "mean squared error of perceptual roughness over pixels with a material"},
      {"metallic_mse", "metallic", "MSE", "mean squared error of metallic over pixels with a material"},
  }};
  return all[static_cast<std::size_t>(error)];
}

MapErrors map_errors(const MapSet& predicted, const MapSet& truth, const MapMasks& masks) {
  return {mean_angle(predicted.normal, truth.normal, masks.geometry),
          rooted_si_log(predicted.depth, truth.depth, masks.geometry),
          scale_invariant_mse(predicted.albedo, truth.albedo, masks.albedo),
          channel_mse(predicted.material, truth.material, masks.material, 0),
          channel_mse(predicted.material, truth.material, masks.material, 1)};
}

MapErrors best_constant_errors(const MapSet& truth, const MapMasks& masks) {
  MapSet constant;
  const int w = truth.depth.width, h = truth.depth.height;
  const auto mean_of = [](const Image& image, int channel, const Image& mask) {
    CompensatedSum total;
    const auto valid = valid_pixels(mask);
    for (const std::size_t i : valid) total.add(image.plane(channel)[i]);
    return valid.empty() ? 0.0 : total.value() / static_cast<double>(valid.size());
  };
  const auto filled = [&](const std::vector<double>& values) {
    Image image(w, h, static_cast<int>(values.size()));
    for (std::size_t c = 0; c < values.size(); ++c)
      std::fill_n(image.plane(static_cast<int>(c)), image.pixels(), static_cast<float>(values[c]));
    return image;
  };
  const Vec3 normal = best_constant_normal(truth.normal, masks.geometry).value_or(Vec3(0, 0, 1));
  constant.normal = filled({normal.x, normal.y, normal.z});
  constant.depth = filled({1});
  constant.albedo = filled({mean_of(truth.albedo, 0, masks.albedo), mean_of(truth.albedo, 1, masks.albedo),
                            mean_of(truth.albedo, 2, masks.albedo)});
  constant.material = filled({mean_of(truth.material, 0, masks.material), mean_of(truth.material, 1, masks.material)});
  return map_errors(constant, truth, masks);
}

}  // namespace clerestory
