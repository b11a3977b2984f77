#include "experiments/training/training_views.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <numeric>

#include "experiments/training/keyed.hpp"
#include "experiments/training/recent.hpp"
#include "experiments/training/validation.hpp"

namespace clerestory {
namespace {

enum Purpose : std::uint64_t { shuffle = 1, cut_draw = 22 };

class FixedViews : public TrainingViews {
 public:
  FixedViews(ViewStore& store, std::uint64_t seed) : store_(store), order_(store.size(), seed) {}

  MakeView at(std::uint64_t position) override {
    return [this, view = order_.at(position)] { return NamedView{store_.name(view).text(), store_.get(view)}; };
  }

  std::vector<ViewName> some(std::uint64_t, std::size_t most) override {
    std::vector<ViewName> names;
    for (const std::size_t i : spread(store_.size(), most)) names.push_back(store_.name(i));
    return names;
  }

 private:
  ViewStore& store_;
  ViewOrder order_;
};

class StreamedViews : public TrainingViews {
 public:
  StreamedViews(const StreamOptions& options, Size size, ViewStore* fixed, std::uint64_t seed, std::uint64_t first)
      : options_(options), size_(size), seed_(seed), rooms_(options, seed, first), recent_(views_in_window(options)) {
    if (options.fixed > 0) fixed_ = fixed_views(*fixed, seed);
  }

  MakeView at(std::uint64_t position) override {
    if (is_fixed(options_, seed_, position)) return fixed_->at(position);
    const ViewName name = rooms_.at(position);
    // Read by the first of its positions that is made, before its files can be dropped: they outlive their window.
    const SharedRead view = recent_.get(name.text(), [&] {
      return std::async(std::launch::deferred, [name] { return read_view(name.room, name.id); }).share();
    });
    const double share = options_.crop_low + (1 - options_.crop_low) * keyed_uniform(seed_, position, cut_draw);
    return [this, name, view, share] {
      const RoomView& whole = view.get();
      const int width = std::max(1, static_cast<int>(std::lround(share * whole.image.width)));
      const int height = std::max(1, static_cast<int>(std::lround(share * whole.image.height)));
      return NamedView{name.text(), prepare_view(centre_of(whole, width, height), size_.width, size_.height)};
    };
  }

  std::vector<ViewName> some(std::uint64_t position, std::size_t most) override {
    const std::vector<ViewName> window = rooms_.window(position);
    std::vector<ViewName> names;
    for (const std::size_t i : spread(window.size(), most)) names.push_back(window[i]);
    return names;
  }

 private:
  using SharedRead = std::shared_future<RoomView>;

  StreamOptions options_;
  Size size_;
  std::uint64_t seed_;
  RoomStream rooms_;
  Recent<SharedRead> recent_;
  std::unique_ptr<TrainingViews> fixed_;
};

}  // namespace

std::size_t ViewOrder::at(std::uint64_t position) {
  const std::uint64_t epoch = position / count_;
  if (epoch != epoch_) {
    order_.resize(count_);
    std::iota(order_.begin(), order_.end(), 0u);
    for (std::size_t i = count_ - 1; i > 0; --i)
      std::swap(order_[i], order_[keyed_bits(seed_ ^ keyed_mix(epoch), i, shuffle) % (i + 1)]);
    epoch_ = epoch;
  }
  return order_[position % count_];
}

std::unique_ptr<TrainingViews> fixed_views(ViewStore& store, std::uint64_t seed) {
  return std::make_unique<FixedViews>(store, seed);
}

std::unique_ptr<TrainingViews> streamed_views(const StreamOptions& options, Size size, ViewStore* fixed,
                                              std::uint64_t seed, std::uint64_t first) {
  return std::make_unique<StreamedViews>(options, size, fixed, seed, first);
}

}  // namespace clerestory
