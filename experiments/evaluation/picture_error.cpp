#include "experiments/evaluation/picture_error.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

constexpr int kScales = 240;  // steps of a factor of 64: 1.7 % each

void add_channel(RadianceErrorSums& sums, const Image& picture, const Image& truth, const std::vector<bool>& used,
                 int c, double scale) {
  const float *ours = picture.plane(c), *theirs = truth.plane(c);
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) sums.add(scale * static_cast<double>(ours[i]), static_cast<double>(theirs[i]));
}

}  // namespace

RadianceError picture_error(const Image& picture, const Image& truth, const std::vector<bool>& used) {
  RadianceErrorSums sums;
  for (int c = 0; c < 3; ++c) add_channel(sums, picture, truth, used, c, 1);
  return sums.error();
}

RadianceError best_scaled_error(const Image& picture, const Image& truth, const std::vector<bool>& used) {
  // Figures are means over channels, or decibels of one, so that each channel has a scale of its own.
  struct Figure {
    double RadianceError::*of;
    double sign;  // -1: more is better
    double least = std::numeric_limits<double>::infinity(), scale = 1;
    RadianceErrorSums sums{};
  };
  std::array<Figure, 4> figures{{{&RadianceError::smape, 1},
                                 {&RadianceError::relmse, 1},
                                 {&RadianceError::psnr, -1},
                                 {&RadianceError::shown_psnr, -1}}};
  for (int c = 0; c < 3; ++c) {
    for (Figure& f : figures) f.least = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= kScales; ++k) {
      const double scale = 0.125 * std::pow(64.0, static_cast<double>(k) / kScales);
      RadianceErrorSums channel;
      add_channel(channel, picture, truth, used, c, scale);
      const RadianceError e = channel.means();
      for (Figure& f : figures)
        if (f.sign * e.*f.of < f.least) f.least = f.sign * e.*f.of, f.scale = scale;
    }
    for (Figure& f : figures) add_channel(f.sums, picture, truth, used, c, f.scale);
  }
  RadianceError error = figures[0].sums.error();
  for (const Figure& f : figures) error.*f.of = f.sums.means().*f.of;
  return error;
}

double relmse_of_pair(const Image& x, const Image& y, const Image& a, const Image& b, const std::vector<bool>& used) {
  CompensatedSum sum;
  double values = 0;
  for (std::size_t i = 0; i < x.data.size(); ++i) {
    if (!used[i % used.size()]) continue;
    const double p = x.data[i], q = y.data[i], s = a.data[i], t = b.data[i], truth = 0.5 * (s + t);
    sum.add(0.5 * ((p - s) * (q - t) + (p - t) * (q - s)) / (truth * truth + kLightFloor)), ++values;
  }
  if (values == 0) throw Error(ErrorKind::Failed, "no pixel to compare", "picture error");
  return sum.value() / values;
}

}  // namespace clerestory
