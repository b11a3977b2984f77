// Previews: tone, normals as colours, a colour scale for amounts and depth.
#include "host/report/preview.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/error.hpp"
#include "host/io/image.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

using Colour = std::array<float, 3>;

// Display values from dark to bright in even steps of lightness, so that the scale also works in grey.
constexpr std::array<Colour, 7> kScale{{{0.106f, 0.110f, 0.259f},
                                        {0.153f, 0.212f, 0.420f},
                                        {0.184f, 0.400f, 0.565f},
                                        {0.227f, 0.569f, 0.533f},
                                        {0.498f, 0.690f, 0.412f},
                                        {0.890f, 0.773f, 0.396f},
                                        {1.000f, 0.953f, 0.839f}}};
constexpr Colour kNothing{0.5f, 0.5f, 0.5f};

Colour scale_colour(double t) {
  const double at = std::clamp(t, 0.0, 1.0) * (kScale.size() - 1);
  const std::size_t i = std::min<std::size_t>(static_cast<std::size_t>(at), kScale.size() - 2);
  const auto f = static_cast<float>(at - static_cast<double>(i));
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = kScale[i][c] + f * (kScale[i + 1][c] - kScale[i][c]);
  return colour;
}

void check_channels(const Image& image, int channels, const char* what) {
  if (image.channels != channels || image.pixels() == 0)
    throw Error(ErrorKind::Failed, "cannot be shown", what,
                fmt::format("{}x{}x{}", image.channels, image.height, image.width),
                fmt::format("{} channels", channels));
}

/// 0 where nothing is finite.
double quantile_of_finite(const Image& image, double q) {
  std::vector<float> finite;
  for (float v : image.data)
    if (std::isfinite(v)) finite.push_back(v);
  return finite.empty() ? 0 : quantile(std::span<const float>(finite), q);
}

std::string mark(double value, const std::string& unit) {
  return fmt::format("{:.3g}{}{}", value, unit.empty() ? "" : " ", unit);
}

Image channel_mean(const Image& image) {
  if (image.channels == 1) return image;
  Image mean(image.width, image.height, 1);
  for (std::size_t p = 0; p < image.pixels(); ++p) {
    double sum = 0;
    for (int c = 0; c < image.channels; ++c) sum += image.plane(c)[p];
    mean.data[p] = static_cast<float>(sum / image.channels);
  }
  return mean;
}

/// One value a pixel to colours; `colour` gets the value.
template <class Map>
Image coloured(const Image& values, const Map& colour) {
  Image out(values.width, values.height, 3);
  for (std::size_t p = 0; p < values.pixels(); ++p) {
    const Colour shown = colour(values.data[p]);
    for (std::size_t c = 0; c < 3; ++c) out.data[c * values.pixels() + p] = shown[c];
  }
  return out;
}

/// A NaN is shown as 0: a preview must not fail where the map's own check speaks.
float unit(double value) { return value > 0 ? static_cast<float>(std::min(value, 1.0)) : 0.0f; }

}  // namespace

Image show_radiance(const Image& linear, double exposure) {
  Image out = linear;
  for (float& v : out.data) v = std::pow(unit(exposure * v), 1 / 2.2f);
  return out;
}

Image show_unit(const Image& values) {
  Image out = values;
  for (float& v : out.data) v = unit(v);
  return out;
}

Image show_normal(const Image& normal) {
  check_channels(normal, 3, "normal");
  Image out = normal;
  for (float& v : out.data) v = unit(0.5 * v + 0.5);
  return out;
}

std::pair<double, double> depth_range(const Image& depth) {
  std::vector<float> valid;
  for (float d : depth.data)
    if (d > 0 && std::isfinite(d)) valid.push_back(d);
  if (valid.empty()) return {0, 0};
  const std::span<const float> all(valid);
  return {quantile(all, 0.02), quantile(all, 0.98)};
}

Image show_depth(const Image& depth, std::pair<double, double> range) {
  check_channels(depth, 1, "depth");
  if (range.second <= 0) range = depth_range(depth);
  const double low = range.first, high = range.second;
  return coloured(depth, [&](float d) {
    if (!(d > 0) || !std::isfinite(d)) return kNothing;
    return scale_colour(high > low ? (high - d) / (high - low) : 0.5);
  });
}

double amount_range(const Image& amount) { return quantile_of_finite(channel_mean(amount), 0.99); }

Image show_amount(const Image& given, double most) {
  const Image amount = channel_mean(given);
  if (most <= 0) most = quantile_of_finite(amount, 0.99);
  return coloured(amount, [&](float v) { return std::isfinite(v) ? scale_colour(most > 0 ? v / most : 0) : kNothing; });
}

ColourBar unit_bar() { return {{{0, 0, 0}, {1, 1, 1}}, {"0", "0.5", "1"}}; }

ColourBar depth_bar(std::pair<double, double> range, const std::string& unit) {
  const auto [near, far] = range;
  return {{kScale.rbegin(), kScale.rend()}, {mark(near, unit), mark(0.5 * (near + far), unit), mark(far, unit)}};
}

ColourBar amount_bar(double most, const std::string& unit) {
  return {{kScale.begin(), kScale.end()}, {mark(0, unit), mark(0.5 * most, unit), mark(most, unit)}};
}

std::string base64(std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  const auto byte = [&](std::size_t i) { return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u; };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned word = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    text += digits[word >> 18];
    text += digits[word >> 12 & 63];
    text += i + 1 < bytes.size() ? digits[word >> 6 & 63] : '=';
    text += i + 2 < bytes.size() ? digits[word & 63] : '=';
  }
  return text;
}

}  // namespace clerestory
