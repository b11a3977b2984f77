// Pictures for people: from linear radiance and maps to what a screen shows, and to the text that embeds them.
#pragma once
#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace clerestory {

struct Image;  // host/io/image.hpp

/// Linear radiance to display values in [0, 1]: clamp(exposure * x)^(1/2.2). One channel becomes grey.
Image show_radiance(const Image& linear, double exposure = 1);
/// Values in [0, 1] that are shown as they are (roughness, metallic, masks); one channel becomes grey.
Image show_unit(const Image& values);
/// Camera-space normals in [-1, 1] to colours: x red, y green, z blue.
Image show_normal(const Image& normal);
/// Metres to colours, near warm, far cool; 0 (no measurement) a quiet grey. `range` in metres, default: the 2nd and
/// 98th percentile.
Image show_depth(const Image& depth, std::pair<double, double> range = {0, 0});
/// A non-negative quantity from 0 (dark) to `most` (bright), in the same colours; of several channels their mean.
/// `most` 0: the 99th percentile.
Image show_amount(const Image& amount, double most = 0);
/// The range show_depth chooses by itself.
std::pair<double, double> depth_range(const Image& depth);
/// The `most` show_amount chooses by itself.
double amount_range(const Image& amount);

/// What the colours of a picture mean.
struct ColourBar {
  std::vector<std::array<float, 3>> colours;  // display values in even steps, left to right
  std::vector<std::string> marks;             // values with their unit, evenly along the bar, at its ends too
};
ColourBar unit_bar();                                                                 // of show_unit
ColourBar depth_bar(std::pair<double, double> range, const std::string& unit = "m");  // of show_depth, near to far
ColourBar amount_bar(double most, const std::string& unit = {});                      // of show_amount

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace clerestory
