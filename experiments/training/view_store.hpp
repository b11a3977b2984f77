// Views of data sets in InteriorVerse's layout, decoded once and kept in memory in half precision.
#pragma once
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "experiments/evaluation/prepare.hpp"

namespace clerestory {

struct ViewName {
  std::filesystem::path room;
  std::string id;
  std::string text() const { return (room / id).string(); }
};

/// All views of the rooms that each root lists under `split`, in the order of roots, list and id. Throws usage_error
/// when a root has no such list, or when there is no view at all.
std::vector<ViewName> name_views(const std::vector<std::string>& roots, const std::string& split);

/// The same of every list that the root has.
std::vector<ViewName> all_views(const std::filesystem::path& root);

/// Identity of a list of views: a run goes on only over the same ones.
std::uint64_t views_hash(const std::vector<ViewName>& views);

/// Decodes on demand, one view at a time; safe to use from several threads. What a view's values are does not depend
/// on whether it was kept.
class ViewStore {
 public:
  /// Views at width x height; at most `cache_bytes` are kept, views beyond are decoded again each time.
  ViewStore(std::vector<ViewName> names, int width, int height, std::uint64_t cache_bytes);

  std::size_t size() const { return names_.size(); }
  const ViewName& name(std::size_t i) const { return names_[i]; }
  const std::vector<ViewName>& names() const { return names_; }
  int width() const { return width_; }
  int height() const { return height_; }
  /// Values rounded to half. Throws what read_view throws.
  PreparedView get(std::size_t i);

 private:
  struct Packed {
    std::vector<std::uint16_t> values;  // image 3, albedo 3, normal 3, depth 1, material 2
    std::vector<std::uint8_t> masks;    // bits: 1 geometry, 2 albedo, 4 material
    double scene_scale = 0;
    std::optional<Camera> camera;
    std::uint64_t bytes() const { return 2 * values.size() + masks.size(); }
  };
  static Packed pack(const PreparedView& view);
  PreparedView unpack(const Packed& packed) const;

  std::vector<ViewName> names_;
  int width_, height_;
  std::uint64_t cache_bytes_, used_ = 0;
  std::vector<Packed> cache_;  // empty values: not kept
  mutable std::mutex mutex_;
};

}  // namespace clerestory
