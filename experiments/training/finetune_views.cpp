#include "experiments/training/finetune_views.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>

#include "experiments/evaluation/benchmark.hpp"
#include "experiments/evaluation/benchmark_errors.hpp"
#include "experiments/evaluation/whdr.hpp"
#include "experiments/training/keyed.hpp"
#include "experiments/training/validation.hpp"
#include "host/error.hpp"
#include "host/math/statistics.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

enum Purpose : std::uint64_t { share_draw = 41, set_draw, cut_draw, left_draw, top_draw, width_draw, gain_draw };

/// Where a cut of `part` pixels begins in `whole`.
int begin_of_cut(int whole, int part, std::uint64_t key, Purpose draw) {
  return static_cast<int>(keyed_bits(key, 0, draw) % static_cast<std::uint64_t>(whole - part + 1));
}

/// The judgements of one kind in a picture's cut, so thinned and weighed that pictures with many count as those with
/// few.
void append_kind(std::vector<JudgedPixels>& to, const std::vector<JudgedPixels>& of_kind) {
  const std::size_t count = std::min(of_kind.size(), kMostJudgements);
  for (const std::size_t i : spread(of_kind.size(), count)) {
    to.push_back(of_kind[i]);
    to.back().weight /= static_cast<float>(count);
  }
}

class FinetuneViews : public TrainingViews {
 public:
  FinetuneViews(std::unique_ptr<TrainingViews> rooms, std::shared_ptr<FinetuneSet> set, Size size, std::uint64_t seed)
      : rooms_(std::move(rooms)), set_(std::move(set)), size_(size), seed_(seed) {}

  MakeView at(std::uint64_t position) override {
    MakeView photograph = set_->at(position, size_, seed_);
    return photograph ? photograph : rooms_->at(position);
  }
  std::vector<ViewName> some(std::uint64_t position, std::size_t most) override { return rooms_->some(position, most); }

 private:
  std::unique_ptr<TrainingViews> rooms_;
  std::shared_ptr<FinetuneSet> set_;
  Size size_;
  std::uint64_t seed_;
};

}  // namespace

struct FinetuneSet::State {
  FinetuneOptions options;
  std::vector<IiwPicture> iiw;
  std::optional<NyuFile> nyu;
  std::vector<int> numbers;
  std::mutex reads_nyu;  // libhdf5 is not safe to use from two threads
  /// Orders of both sets of a stream's seed.
  std::optional<ViewOrder> iiw_order, nyu_order;

  ViewName nyu_view_name(int number) const { return {options.nyu, nyu_name(number)}; }

  NamedView judged(std::size_t i, Size size, std::uint64_t key) const {
    const IiwPicture& one = iiw[i];
    return {one.picture.string(), iiw_view(read_photo(one.picture).image, read_judgements(one.judgements), size, key),
            true};
  }
  NamedView measured(std::size_t i, Size size, std::uint64_t key) {
    const int number = numbers[i];
    Image picture, depth;
    {
      const std::lock_guard lock(reads_nyu);
      picture = nyu->picture(number), depth = nyu->depth(number);
    }
    return {nyu_view_name(number).text(), nyu_view(picture, depth, read_nyu_normals(options.nyu, number), size, key),
            true};
  }
};

FinetuneSet::FinetuneSet(const FinetuneOptions& options) : state_(std::make_unique<State>()) {
  state_->options = options;
  if (!options.iiw.empty()) {
    state_->iiw = iiw_split(list_iiw(options.iiw), false);
    if (state_->iiw.empty())
      throw usage_error("the training split holds no photograph", options.iiw.string(), "",
                        "two at least: every fifth, from the first on, is for tests");
  }
  if (!options.nyu.empty()) {
    if (!fs::is_directory(options.nyu / "normals"))
      throw usage_error("there are no normals to learn from", options.nyu.string(), "",
                        std::string("folders normals and masks with NNNN.png, beside ") + kNyuFile);
    state_->nyu.emplace(options.nyu / kNyuFile);
    state_->numbers = nyu_numbers(*state_->nyu, options.nyu_list);
  }
}

FinetuneSet::~FinetuneSet() = default;

std::vector<ViewName> FinetuneSet::names() const {
  std::vector<ViewName> names;
  for (const IiwPicture& one : state_->iiw) names.push_back({state_->options.iiw, one.id});
  for (const int number : state_->numbers) names.push_back(state_->nyu_view_name(number));
  return names;
}

std::string FinetuneSet::text() const {
  std::vector<std::string> sets;
  if (!state_->iiw.empty()) sets.push_back(fmt::format("{} of IIW", state_->iiw.size()));
  if (!state_->numbers.empty()) sets.push_back(fmt::format("{} of NYUv2", state_->numbers.size()));
  return fmt::format("photographs in {:g} % of the views: {}", 100 * state_->options.share, fmt::join(sets, ", "));
}

MakeView FinetuneSet::at(std::uint64_t position, Size size, std::uint64_t seed) {
  State& s = *state_;
  if (!(keyed_uniform(seed, position, share_draw) < s.options.share)) return {};
  const std::uint64_t key = keyed_bits(seed, position, cut_draw);
  const bool both = !s.iiw.empty() && !s.numbers.empty();
  const bool judged = both ? keyed_uniform(seed, position, set_draw) < 0.5 : !s.iiw.empty();
  std::optional<ViewOrder>& order = judged ? s.iiw_order : s.nyu_order;
  if (!order) order.emplace(judged ? s.iiw.size() : s.numbers.size(), seed);
  const std::size_t i = order->at(position);
  return [&s, judged, i, size, key] { return judged ? s.judged(i, size, key) : s.measured(i, size, key); };
}

std::unique_ptr<TrainingViews> finetune_views(std::unique_ptr<TrainingViews> rooms, std::shared_ptr<FinetuneSet> set,
                                              Size size, std::uint64_t seed) {
  return std::make_unique<FinetuneViews>(std::move(rooms), std::move(set), size, seed);
}

PreparedView iiw_view(const Image& linear, const Judgements& judgements, Size size, std::uint64_t key) {
  const double factor =
      std::max(static_cast<double>(size.width) / linear.width, static_cast<double>(size.height) / linear.height);
  const int width = std::max(size.width, static_cast<int>(std::lround(factor * linear.width)));
  const int height = std::max(size.height, static_cast<int>(std::lround(factor * linear.height)));
  const int left = begin_of_cut(width, size.width, key, left_draw);
  const int top = begin_of_cut(height, size.height, key, top_draw);

  PreparedView view;
  view.image = window(resize_area(linear, width, height), left, top, size.width, size.height);
  scale(view.image.data, static_cast<float>(exposure_of(linear.data)));
  const auto nothing = [&](int channels) { return Image(size.width, size.height, channels); };
  view.truth = {nothing(3), nothing(3), nothing(1), nothing(2)};
  view.masks = {nothing(1), nothing(1), nothing(1)};

  const auto pixel_of = [&](const JudgedPoint& point) {  // -1: outside of the cut
    const int x = std::min(static_cast<int>(point.x * width), width - 1) - left;
    const int y = std::min(static_cast<int>(point.y * height), height - 1) - top;
    return x < 0 || y < 0 || x >= size.width || y >= size.height ? -1 : y * size.width + x;
  };
  std::vector<JudgedPixels> equal, ordered;
  for (const JudgedPair& j : judgements.comparisons) {
    if (!counts(judgements, j)) continue;
    const int a = pixel_of(judgements.points[j.first]), b = pixel_of(judgements.points[j.second]);
    if (a < 0 || b < 0) continue;
    const auto weight = static_cast<float>(j.weight);
    if (*j.darker == Darker::Equal) equal.push_back({a, b, true, weight});
    if (*j.darker == Darker::First) ordered.push_back({a, b, false, weight});
    if (*j.darker == Darker::Second) ordered.push_back({b, a, false, weight});
  }
  append_kind(view.judged, equal), append_kind(view.judged, ordered);
  return view;
}

PreparedView nyu_view(const Image& linear, const Image& depth, const NyuNormals& normals, Size size,
                      std::uint64_t key) {
  const double share = (560 + 40 * keyed_uniform(key, 0, width_draw)) / 640;
  const int width = std::max(1, static_cast<int>(std::lround(share * linear.width)));
  const int height = std::max(1, static_cast<int>(std::lround(share * linear.height)));
  const int left = begin_of_cut(linear.width, width, key, left_draw);
  const int top = begin_of_cut(linear.height, height, key, top_draw);
  const auto part = [&](const Image& map) { return window(map, left, top, width, height); };

  RoomView whole;
  whole.image = part(linear), whole.depth = part(depth), whole.normal = part(normals.normal);
  whole.mask = part(normals.mask);
  whole.albedo = Image(width, height, 3), whole.material = Image(width, height, 3);
  for (int c = 0; c < 3; ++c) {
    const auto gain = static_cast<float>(0.8 + 0.4 * keyed_uniform(key, static_cast<std::uint64_t>(c), gain_draw));
    for (std::size_t i = 0; i < whole.image.pixels(); ++i) whole.image.plane(c)[i] *= gain;
  }
  for (std::size_t i = 0; i < whole.mask.data.size(); ++i)
    if (!(whole.depth.data[i] > kNearestJudged && whole.depth.data[i] < kFarthestJudged)) whole.mask.data[i] = 0;

  PreparedView view = prepare_view(whole, size.width, size.height);
  std::ranges::fill(view.masks.albedo.data, 0.0f);
  return view;
}

}  // namespace clerestory
