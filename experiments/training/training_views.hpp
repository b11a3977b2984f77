// The endless stream of views that a leg of training sees, whether they lie in folders or are made on the way.
#pragma once
#include <functional>
#include <memory>
#include <string>

#include "experiments/training/room_stream.hpp"
#include "experiments/training/view_store.hpp"

namespace clerestory {

struct NamedView {
  std::string name;
  PreparedView view;
  bool photograph = false;  // a real one, which has gone through a camera already
};

/// Position `position` of the endless stream over `count` views: every epoch visits each view once, in an order that
/// depends on (seed, epoch).
class ViewOrder {
 public:
  ViewOrder(std::size_t count, std::uint64_t seed) : count_(count), seed_(seed) {}
  std::size_t at(std::uint64_t position);

 private:
  std::size_t count_;
  std::uint64_t seed_;
  std::uint64_t epoch_ = ~std::uint64_t{0};
  std::vector<std::uint32_t> order_;
};

/// Reads, cuts and resizes a view that was chosen. May be called once, by any thread, while others are.
using MakeView = std::function<NamedView()>;

/// Which view stands at a position, and how it is cut, are functions of (seed, position). A position counts views over
/// all legs.
class TrainingViews {
 public:
  virtual ~TrainingViews() = default;
  /// What makes the view of a position; it throws what read_view throws. Positions do not fall by more than a window
  /// of rooms, and one thread asks for them.
  virtual MakeView at(std::uint64_t position) = 0;
  /// Up to `most` of the views that stand at or near a position, spread, for the mean maps.
  virtual std::vector<ViewName> some(std::uint64_t position, std::size_t most) = 0;
};

/// Views of folders, through their store, in the order of epochs.
std::unique_ptr<TrainingViews> fixed_views(ViewStore& store, std::uint64_t seed);

/// Views of rooms that are made on the way, at `size`, cut as the options say; `fixed` (not null where options.fixed is
/// above 0) has its share. `first`: the position that will be asked for first.
std::unique_ptr<TrainingViews> streamed_views(const StreamOptions& options, Size size, ViewStore* fixed,
                                              std::uint64_t seed, std::uint64_t first);

}  // namespace clerestory
