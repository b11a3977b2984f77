#include "experiments/evaluation/flip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr double kPi = std::numbers::pi;
using Color = std::array<double, 3>;
using Plane = std::vector<double>;

/// Three planes, or two of features.
struct Planes {
  int width = 0, height = 0;
  std::vector<Plane> of;
};

// ---- Colours --------------------------------------------------------------------------------------------------------

/// Linear Rec.709 to CIE XYZ.
constexpr std::array<Color, 3> kToXyz{{{10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
                                       {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
                                       {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}}};

Color multiply(const std::array<Color, 3>& m, const Color& v) {
  Color out{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) out[r] += m[r][c] * v[c];
  return out;
}

std::array<Color, 3> inverse(const std::array<Color, 3>& m) {
  std::array<Color, 3> out;
  double determinant = 0;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      out[c][r] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
      if (r == 0) determinant += m[0][c] * out[c][0];
    }
  for (Color& row : out)
    for (double& v : row) v /= determinant;
  return out;
}

/// XYZ over that of white.
Color over_white(const Color& rgb) {
  const Color white = multiply(kToXyz, {1, 1, 1});
  Color xyz = multiply(kToXyz, rgb);
  for (std::size_t c = 0; c < 3; ++c) xyz[c] /= white[c];
  return xyz;
}

/// YCxCz: brightness and two opponent colours, linear in radiance, so that they can be filtered.
Color opponent(const Color& rgb) {
  const Color w = over_white(rgb);
  return {116 * w[1] - 16, 500 * (w[0] - w[1]), 200 * (w[1] - w[2])};
}

Color linear_of_opponent(const Color& c) {
  static const std::array<Color, 3> from_xyz = inverse(kToXyz);
  const Color white = multiply(kToXyz, {1, 1, 1});
  const double y = (c[0] + 16) / 116;
  return multiply(from_xyz, {(y + c[1] / 500) * white[0], y * white[1], (y - c[2] / 200) * white[2]});
}

/// CIELab, its colours weaker where it is dark (Hunt's effect).
Color hunt_lab(const Color& rgb) {
  const auto f = [](double t) {
    constexpr double d = 6.0 / 29;
    return t > d * d * d ? std::cbrt(t) : t / (3 * d * d) + 4.0 / 29;
  };
  const Color w = over_white(rgb);
  const double brightness = 116 * f(w[1]) - 16;
  return {brightness, 0.01 * brightness * 500 * (f(w[0]) - f(w[1])), 0.01 * brightness * 200 * (f(w[1]) - f(w[2]))};
}

double hyab(const Color& a, const Color& b) { return std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]); }

// ---- Filters --------------------------------------------------------------------------------------------------------

/// Taps from -r to r.
using Taps = std::vector<double>;

Taps gaussian(double exponent, int radius) {  // exp(-exponent x^2)
  Taps taps;
  for (int x = -radius; x <= radius; ++x) taps.push_back(std::exp(-exponent * x * x));
  return taps;
}

double sum_of(const Taps& taps) {
  double sum = 0;
  for (const double t : taps) sum += t;
  return sum;
}

/// The plane filtered by `across` along rows and `down` along columns; the border goes on as it ends.
Plane filtered(const Plane& plane, int width, int height, const Taps& across, const Taps& down) {
  const auto pass = [&](const Plane& from, const Taps& taps, bool along_rows) {
    const int radius = static_cast<int>(taps.size()) / 2;
    Plane to(from.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int k = -radius; k <= radius; ++k) {
          const int from_x = along_rows ? std::clamp(x + k, 0, width - 1) : x,
                    from_y = along_rows ? y : std::clamp(y + k, 0, height - 1);
          sum += taps[static_cast<std::size_t>(k + radius)] * from[static_cast<std::size_t>(from_y) * width + from_x];
        }
        to[static_cast<std::size_t>(y) * width + x] = sum;
      }
    return to;
  };
  return pass(pass(plane, across, true), down, false);
}

/// What the eye resolves of a channel: a sum of Gaussians, a in frequency space and b the square of a width in degrees.
struct Sensitivity {
  struct Term {
    double a, b;
  };
  std::vector<Term> terms;
};
const std::array<Sensitivity, 3> kSensitivities{
    {{{{1, 0.0047}}}, {{{1, 0.0053}}}, {{{34.1, 0.04}, {13.5, 0.025}}}}};  // brightness, red-green, blue-yellow

Plane as_seen(const Plane& plane, int width, int height, const Sensitivity& eye, double pixels_per_degree) {
  constexpr double widest = 0.04;
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(widest / (2 * kPi * kPi)) * pixels_per_degree));
  Plane sum(plane.size());
  double weight = 0;
  for (const auto& [a, b] : eye.terms) {
    const Taps taps = gaussian(kPi * kPi / (b * pixels_per_degree * pixels_per_degree), radius);
    const double factor = a * std::sqrt(kPi / b);
    weight += factor * sum_of(taps) * sum_of(taps);
    const Plane part = filtered(plane, width, height, taps, taps);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += factor * part[i];
  }
  for (double& v : sum) v /= weight;
  return sum;
}

/// Taps whose negative part sums to -1 and whose positive part to 1.
Taps balanced(Taps taps) {
  double positive = 0, negative = 0;
  for (const double t : taps) (t > 0 ? positive : negative) += std::abs(t);
  for (double& t : taps) t /= t > 0 ? positive : negative;
  return taps;
}

/// Of each pixel how strong an edge and how strong a point is there: first and second derivatives of brightness,
/// smoothed to the width of features that are seen best.
Planes features(const Plane& brightness, int width, int height, double pixels_per_degree) {
  const double deviation = 0.5 * 0.082 * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  const Taps bell = gaussian(0.5 / (deviation * deviation), radius);
  Taps smooth = bell, edge, point;
  for (double& t : smooth) t /= sum_of(bell);
  for (int x = -radius; x <= radius; ++x) {
    const double g = bell[static_cast<std::size_t>(x + radius)];
    edge.push_back(-x * g), point.push_back((x * x / (deviation * deviation) - 1) * g);
  }
  Planes found{width, height, {}};
  for (const Taps& derivative : {balanced(edge), balanced(point)}) {
    const Plane across = filtered(brightness, width, height, derivative, smooth),
                down = filtered(brightness, width, height, smooth, derivative);
    Plane size(brightness.size());
    for (std::size_t i = 0; i < size.size(); ++i) size[i] = std::hypot(across[i], down[i]);
    found.of.push_back(std::move(size));
  }
  return found;
}

// ---- Both pipelines -------------------------------------------------------------------------------------------------

Color color_at(const Planes& planes, std::size_t i) { return {planes.of[0][i], planes.of[1][i], planes.of[2][i]}; }

Planes opponent_of(const Image& picture) {
  Planes planes{picture.width, picture.height, std::vector<Plane>(3, Plane(picture.pixels()))};
  for (std::size_t i = 0; i < picture.pixels(); ++i) {
    Color rgb;
    for (int c = 0; c < 3; ++c) rgb[static_cast<std::size_t>(c)] = std::clamp<double>(picture.plane(c)[i], 0, 1);
    const Color seen = opponent(rgb);
    for (std::size_t c = 0; c < 3; ++c) planes.of[c][i] = seen[c];
  }
  return planes;
}

/// Colours as they are compared.
Planes lab_as_seen(const Planes& picture, double pixels_per_degree) {
  Planes seen{picture.width, picture.height, {}};
  for (std::size_t c = 0; c < 3; ++c)
    seen.of.push_back(as_seen(picture.of[c], picture.width, picture.height, kSensitivities[c], pixels_per_degree));
  for (std::size_t i = 0; i < seen.of[0].size(); ++i) {
    Color rgb = linear_of_opponent(color_at(seen, i));
    for (double& v : rgb) v = std::clamp(v, 0.0, 1.0);
    const Color lab = hunt_lab(rgb);
    for (std::size_t c = 0; c < 3; ++c) seen.of[c][i] = lab[c];
  }
  return seen;
}

/// Differences of colour in [0, 1]: large ones, which all look large, share the last twentieth.
double color_difference(const Color& a, const Color& b) {
  constexpr double exponent = 0.7, knee = 0.4, at_knee = 0.95;
  static const double most = std::pow(hyab(hunt_lab({0, 1, 0}), hunt_lab({0, 0, 1})), exponent);
  const double d = std::pow(hyab(a, b), exponent);
  return d < knee * most ? d * at_knee / (knee * most)
                         : at_knee + (d - knee * most) / (most - knee * most) * (1 - at_knee);
}

Planes features_of(const Planes& picture, double pixels_per_degree) {
  Plane brightness = picture.of[0];
  for (double& v : brightness) v = (v + 16) / 116;
  return features(brightness, picture.width, picture.height, pixels_per_degree);
}

}  // namespace

Image flip(const Image& reference, const Image& test, double pixels_per_degree) {
  for (const Image* picture : {&reference, &test})
    if (picture->channels != 3 || picture->width != reference.width || picture->height != reference.height)
      throw Error(ErrorKind::Failed, "pictures that cannot be compared", "flip",
                  fmt::format("{}x{}x{}", picture->width, picture->height, picture->channels),
                  fmt::format("{}x{}x3", reference.width, reference.height));
  const Planes ours = opponent_of(test), theirs = opponent_of(reference);
  const Planes lab = lab_as_seen(ours, pixels_per_degree), true_lab = lab_as_seen(theirs, pixels_per_degree);
  const Planes marks = features_of(ours, pixels_per_degree), true_marks = features_of(theirs, pixels_per_degree);
  Image map(reference.width, reference.height, 1);
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    const double edges = std::abs(marks.of[0][i] - true_marks.of[0][i]),
                 points = std::abs(marks.of[1][i] - true_marks.of[1][i]);
    const double feature = std::sqrt(std::max(edges, points) / std::numbers::sqrt2);
    map.data[i] = static_cast<float>(
        std::pow(color_difference(color_at(true_lab, i), color_at(lab, i)), 1 - std::min(feature, 1.0)));
  }
  return map;
}

}  // namespace clerestory
