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
  const double exposure = exposure_of(pictures.at(0).picture.data);
  std::vector<StripPicture> shown;
  for (const StripPicture& one : pictures) shown.push_back({one.label, show_radiance(one.picture, exposure)});
  write_sheet(png, {shown});
}

void write_sheet(const fs::path& png, const std::vector<std::vector<StripPicture>>& rows) {
  const Image& first = rows.at(0).at(0).picture;
  const int w = first.width, h = first.height;
  Image sheet(static_cast<int>(rows[0].size()) * w, static_cast<int>(rows.size()) * h, 3);
  nlohmann::json labels = nlohmann::json::array();
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t k = 0; k < rows[r].size(); ++k) {
      for (int c = 0; c < 3; ++c)
        for (int y = 0; y < h; ++y) {
          const float* row = rows[r][k].picture.plane(std::min(c, rows[r][k].picture.channels - 1)) +
                             static_cast<std::ptrdiff_t>(y) * w;
          const std::ptrdiff_t line = static_cast<std::ptrdiff_t>(r) * h + y;
          std::copy(row, row + w, sheet.plane(c) + line * sheet.width + static_cast<std::ptrdiff_t>(k) * w);
        }
      labels.push_back(rows[r][k].label);
    }
  write_png(png, sheet, Encoding::Linear);
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
