// Pictures for people: from linear radiance and maps to what a screen shows, and to the text that embeds them.
#pragma once
#include <string>
#include <string_view>
#include <utility>

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

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace clerestory
