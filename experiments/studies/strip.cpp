#include "experiments/studies/strip.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/io/files.hpp"
#include "host/io/json_file.hpp"
#include "host/math/statistics.hpp"
#include "host/report/preview.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostBytes = 1 << 16;

fs::path labels_of(const fs::path& png) { return fs::path(png).replace_extension(".labels.json"); }

}  // namespace

void write_strip(const fs::path& png, const std::vector<StripPicture>& pictures) {
  const Image& first = pictures.at(0).picture;
  const int w = first.width, h = first.height;
  const double exposure = exposure_of(first.data);
  Image strip(static_cast<int>(pictures.size()) * w, h, 3);
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const Image shown = show_radiance(pictures[k].picture, exposure);
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < h; ++y) {
        const float* row = shown.plane(c) + static_cast<std::ptrdiff_t>(y) * w;
        std::copy(row, row + w,
                  strip.plane(c) + static_cast<std::ptrdiff_t>(y) * strip.width + static_cast<int>(k) * w);
      }
  }
  write_png(png, strip, Encoding::Linear);
  nlohmann::json labels = nlohmann::json::array();
  for (const StripPicture& one : pictures) labels.push_back(one.label);
  write_file(labels_of(png), labels.dump() + "\n");
}

std::vector<std::string> strip_labels(const fs::path& png) {
  const fs::path file = labels_of(png);
  if (!fs::is_regular_file(file)) return {};
  const nlohmann::json json = parse_json(read_file(file, kMostBytes), file.string());
  std::vector<std::string> labels;
  if (json.is_array())
    for (const auto& label : json)
      if (label.is_string()) labels.push_back(label.get<std::string>());
  return labels;
}

}  // namespace clerestory
