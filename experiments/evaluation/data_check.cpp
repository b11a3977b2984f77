#include "experiments/evaluation/data_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::array<MapQuantityInfo, kMapQuantities> kInfo{{{"albedo", "luminance", 0, 1, false},
                                                             {"roughness", "", 0, 1, false},
                                                             {"metallic", "", 0, 1, false},
                                                             {"normal to the optical axis", "degrees", 0, 180, false},
                                                             {"depth", "m", 0.1, 100, true},
                                                             {"radiance", "white = 1", 1e-4, 1e3, true},
                                                             {"step of albedo", "luminance", 1e-4, 1, true},
                                                             {"step of normals", "degrees", 1e-2, 180, true},
                                                             {"step of depth", "ln", 1e-5, 10, true}}};
constexpr double kTolerance = 1e-3;                // of ranges: maps are stored in half precision
constexpr double kLeastValid = 0.1;                // share of a view's pixels
constexpr double kNearest = 0.1, kFarthest = 100;  // metres, of the median in a room

double degrees_of(double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi; }

double luminance_at(const Image& image, std::size_t i) {
  return luminance(image.plane(0)[i], image.plane(1)[i], image.plane(2)[i]);
}

double cosine(const Image& normal, std::size_t i, std::size_t j) {
  double sum = 0;
  for (int c = 0; c < 3; ++c) sum += static_cast<double>(normal.plane(c)[i]) * normal.plane(c)[j];
  return sum;
}

/// Adds what the pixels of a view show to the folder's histograms.
void count(const RoomView& view, std::vector<Histogram>& histograms) {
  const auto add = [&](MapQuantity quantity, double value) {
    histograms[static_cast<std::size_t>(quantity)].add(value);
  };
  const auto width = static_cast<std::size_t>(view.mask.width), height = static_cast<std::size_t>(view.mask.height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      if (view.mask.data[i] == 0) continue;
      add(MapQuantity::Albedo, luminance_at(view.albedo, i));
      add(MapQuantity::Roughness, view.material.plane(0)[i]), add(MapQuantity::Metallic, view.material.plane(1)[i]);
      add(MapQuantity::Facing, degrees_of(view.normal.plane(2)[i]));
      add(MapQuantity::Depth, view.depth.data[i]), add(MapQuantity::Radiance, luminance_at(view.image, i));
      if (x + 1 == width || view.mask.data[i + 1] == 0) continue;
      add(MapQuantity::AlbedoStep, std::abs(luminance_at(view.albedo, i + 1) - luminance_at(view.albedo, i)));
      add(MapQuantity::NormalStep, degrees_of(cosine(view.normal, i, i + 1)));
      add(MapQuantity::DepthStep, std::abs(std::log(view.depth.data[i + 1]) - std::log(view.depth.data[i])));
    }
}

/// Of the valid pixels' values in `channels` of a map, the first beyond 0 to 1, in words; empty where there is none.
std::string out_of_range(const Image& map, const Image& mask, int channels) {
  for (int c = 0; c < channels; ++c)
    for (std::size_t i = 0; i < map.pixels(); ++i) {
      const double v = map.plane(c)[i];
      if (mask.data[i] != 0 && !(v >= -kTolerance && v <= 1 + kTolerance))
        return fmt::format("{:g} at ({}, {}); expected 0 to 1", v, i % static_cast<std::size_t>(map.width),
                           i / static_cast<std::size_t>(map.width));
    }
  return {};
}

class Checker {
 public:
  explicit Checker(DataCheck& check) : check_(check) {}

  void look_at(const fs::path& room, const std::string& id) {
    ++check_.views;
    try {
      UnfilledPixels unfilled;
      const RoomView view = read_view(room, id, {}, &unfilled);
      take(view);
      judge(view, unfilled, [&](const char* what) { return view_file(room, id, what); });
    } catch (const Error& e) {
      problem(e);
    }
  }

  void problem(const fs::path& file, const std::string& what) { check_.problems.push_back({file.string(), what}); }
  /// What cannot be read is a problem of its file; throws again what is none.
  void problem(const Error& e) {
    if (e.kind() != ErrorKind::Usage) throw e;
    problem(e.where(), e.reason());
  }

 private:
  void take(const RoomView& view) {
    ++check_.usable;
    check_.with_camera += view.camera.has_value(), check_.with_emission += view.emission.has_value();
    const int w = view.image.width, h = view.image.height;
    const bool first = check_.usable == 1;
    check_.least_width = first ? w : std::min(check_.least_width, w);
    check_.least_height = first ? h : std::min(check_.least_height, h);
    check_.most_width = std::max(check_.most_width, w), check_.most_height = std::max(check_.most_height, h);
    check_.pixels += view.mask.pixels(), check_.valid += valid_pixels(view);
    count(view, check_.histograms);
  }

  template <class FileOf>
  void judge(const RoomView& view, const UnfilledPixels& unfilled, FileOf file_of) {
    const std::size_t pixels = view.mask.pixels(), valid = valid_pixels(view);
    const auto some = [&](const char* map, std::size_t number, const char* what) {
      if (number > 0)
        problem(file_of(map), fmt::format("{} of {} pixels, valid by their mask, {}", number, pixels, what));
    };
    some("albedo", unfilled.albedo, "are not finite");
    some("material", unfilled.material, "are not finite");
    some("depth", unfilled.depth, "have no depth");
    some("normal", unfilled.normal, "have no normal");
    some("normal", unfilled.normal_length, "have a normal that is not of unit length");
    if (static_cast<double>(valid) < kLeastValid * static_cast<double>(pixels))
      problem(file_of("mask"), fmt::format("{} of {} pixels are valid", valid, pixels));
    if (std::ranges::all_of(view.image.data, [](float v) { return v == 0; }))
      problem(file_of("im"), "the picture is black");
    if (const std::string text = out_of_range(view.albedo, view.mask, 3); !text.empty())
      problem(file_of("albedo"), "albedo is " + text);
    if (const std::string text = out_of_range(view.material, view.mask, 2); !text.empty())
      problem(file_of("material"), "roughness or metallic is " + text);
    if (const double depth = median_depth(view); valid > 0 && !(depth >= kNearest && depth <= kFarthest))
      problem(file_of("depth"), fmt::format("the median depth is {:g} m; expected {:g} to {:g}, stored in millimetres",
                                            depth, kNearest, kFarthest));
  }

  static std::size_t valid_pixels(const RoomView& view) {
    return static_cast<std::size_t>(std::ranges::count_if(view.mask.data, [](float m) { return m != 0; }));
  }

  static double median_depth(const RoomView& view) {
    std::vector<double> depth;
    for (std::size_t i = 0; i < view.mask.pixels(); ++i)
      if (view.mask.data[i] != 0) depth.push_back(view.depth.data[i]);
    return depth.empty() ? 0 : median(depth);
  }

  DataCheck& check_;
};

struct NamedView {
  fs::path room;
  std::string id;
};

/// Views of every list that the folder has; lists, lines and rooms that cannot be read become problems.
std::vector<NamedView> listed_views(DataCheck& check, Checker& checker) {
  std::vector<NamedView> views;
  std::map<std::string, fs::path> list_of;  // by room
  bool any = false;
  for (const char* split : {"train", "val", "test"}) {
    const fs::path list = check.folder / (std::string(split) + ".txt");
    if (!fs::exists(list)) continue;
    any = true;
    const std::vector<std::string> names = list_rooms(check.folder, split, [&](const Error& e) { checker.problem(e); });
    if (names.empty()) checker.problem(list, "the list names no room");
    for (const std::string& name : names) {
      const fs::path room = check.folder / name;
      if (const auto [before, added] = list_of.emplace(name, list); !added) {
        checker.problem(list, fmt::format("{} is a room of {} too", name, before->second.string()));
        continue;
      }
      ++check.rooms;
      try {
        const std::vector<std::string> ids = list_views(room, {"im", "mask", "albedo", "depth", "material", "normal"});
        if (ids.empty()) checker.problem(room, "the room has no view");
        for (const std::string& id : ids) views.push_back({room, id});
      } catch (const Error& e) {
        checker.problem(e);
      }
    }
  }
  if (!any)
    throw usage_error("the folder has no list of rooms", check.folder.string(), "", "train.txt, val.txt or test.txt");
  return views;
}

}  // namespace

const MapQuantityInfo& info(MapQuantity quantity) { return kInfo.at(static_cast<std::size_t>(quantity)); }

double Histogram::position(double value) const {
  if (!info_->logarithmic) return (value - info_->low) / (info_->high - info_->low);
  return value > 0 ? std::log(value / info_->low) / std::log(info_->high / info_->low) : 0;
}

double Histogram::value(double position) const {
  if (!info_->logarithmic) return info_->low + position * (info_->high - info_->low);
  return info_->low * std::pow(info_->high / info_->low, position);
}

void Histogram::add(double value) {
  const double at = std::clamp(position(value), 0.0, 1.0);
  ++bins_[static_cast<std::size_t>(std::min(at * kBins, kBins - 1.0))];
  ++count_;
  least_ = std::min(least_, value), most_ = std::max(most_, value);
}

double Histogram::quantile(double q) const {
  if (count_ == 0) return std::numeric_limits<double>::quiet_NaN();
  double left = q * static_cast<double>(count_);
  std::size_t bin = 0;
  while (bin + 1 < kBins && left > static_cast<double>(bins_[bin])) left -= static_cast<double>(bins_[bin++]);
  return std::clamp(value((static_cast<double>(bin) + 0.5) / kBins), least_, most_);
}

Histogram::Shares Histogram::shares(int bins) const {
  Shares out;
  for (int k = 0; k < bins; ++k) {
    const auto first = static_cast<std::size_t>(k * kBins / bins);
    const auto last = static_cast<std::size_t>((k + 1) * kBins / bins);
    std::uint64_t sum = 0;
    for (std::size_t i = first; i < last; ++i) sum += bins_[i];
    out.at.push_back(value((k + 0.5) / bins));
    out.share.push_back(count_ > 0 ? static_cast<double>(sum) / static_cast<double>(count_) : 0);
  }
  return out;
}

DataCheck check_data(const fs::path& folder, int most_views, const std::function<void(int, int)>& progress) {
  DataCheck check;
  check.folder = folder;
  for (int q = 0; q < kMapQuantities; ++q) check.histograms.emplace_back(static_cast<MapQuantity>(q));
  Checker checker(check);
  const std::vector<NamedView> views = listed_views(check, checker);
  const int all = static_cast<int>(views.size()), total = most_views > 0 ? std::min(most_views, all) : all;
  for (int k = 0; k < total; ++k) {
    const NamedView& view = views[static_cast<std::size_t>(static_cast<long>(k) * all / total)];
    checker.look_at(view.room, view.id);
    if (progress) progress(k + 1, total);
  }
  return check;
}

}  // namespace clerestory
