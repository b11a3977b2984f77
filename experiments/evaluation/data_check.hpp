// What lies in a folder of rooms in InteriorVerse's layout: how its maps are distributed, and which files are at fault.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "host/io/datasets.hpp"

namespace clerestory {

/// What is counted over all valid pixels. Steps are between a pixel and its right neighbour, both valid.
enum class MapQuantity {
  Albedo,      // luminance
  Roughness,   //
  Metallic,    //
  Facing,      // degrees between the normal and the optical axis, towards the camera
  Depth,       // metres
  Radiance,    // luminance; white is 1
  AlbedoStep,  // |difference of luminance|
  NormalStep,  // degrees between the normals
  DepthStep    // |difference of ln depth|
};
inline constexpr int kMapQuantities = 9;
struct MapQuantityInfo {
  const char *name, *unit;
  double low, high;  // of the histogram; what lies beyond counts in its first or last bin
  bool logarithmic;  // equal bins in the logarithm
};
const MapQuantityInfo& info(MapQuantity quantity);

class Histogram {
 public:
  explicit Histogram(MapQuantity quantity) : info_(&info(quantity)) {}
  void add(double value);
  std::uint64_t count() const { return count_; }
  /// To half a bin, and among the numbers: the value below which a part q of the numbers lies; NaN of none.
  double quantile(double q) const;
  /// Middles of `bins` wider bins, and the share of the numbers in each.
  struct Shares {
    std::vector<double> at, share;
  };
  Shares shares(int bins) const;

 private:
  static constexpr int kBins = 1200;
  double position(double value) const;  // 0 to 1 over the range
  double value(double position) const;
  const MapQuantityInfo* info_;
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0;
  double least_ = std::numeric_limits<double>::infinity(), most_ = -least_;  // of the numbers
};

struct DataProblem {
  std::string file, what;
};

struct DataCheck {
  std::filesystem::path folder;
  int rooms = 0, views = 0, usable = 0;
  int with_camera = 0, with_emission = 0;  // of the usable views
  int least_width = 0, least_height = 0, most_width = 0, most_height = 0;
  std::uint64_t pixels = 0, valid = 0;  // of usable views
  std::vector<Histogram> histograms;    // by MapQuantity
  std::vector<DataProblem> problems;    // in the order of the lists; a view with one may be usable
};

/// Looks at the rooms of every list in the folder; `most_views` of all their views, spread evenly, or all where that is
/// 0. A line of a list, a room or a view that cannot be read becomes a problem and is left out of the figures; so does
/// a map that is beyond its range, has holes or is half there, but it is kept. A room of two lists counts once.
/// `progress(done, total)` is called after each view. Throws usage_error where the folder has no list at all.
DataCheck check_data(const std::filesystem::path& folder, int most_views,
                     const std::function<void(int, int)>& progress = {});

}  // namespace clerestory
