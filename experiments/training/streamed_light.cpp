#include "experiments/training/streamed_light.hpp"

#include <algorithm>

namespace clerestory {

StreamedLight::StreamedLight(const StreamOptions& options, Size size, std::uint64_t seed, std::uint64_t first,
                             Predict predict)
    : size_(size),
      predict_(std::move(predict)),
      rooms_(options, seed, first),
      most_(static_cast<std::size_t>(options.window * options.rooms.views)) {}

StreamedLight::Kept& StreamedLight::kept(const ViewName& name) {
  const std::string text = name.text();
  const auto found = std::ranges::find(recent_, text, &Kept::name);
  if (found != recent_.end()) return *found;
  if (recent_.size() == most_) recent_.pop_front();
  const auto view = std::make_shared<const LightView>(read_light_view(name, size_.width, size_.height));
  return recent_.emplace_back(Kept{text, view, nullptr});
}

NamedLightView StreamedLight::at(std::uint64_t position, bool predicted) {
  Kept& view = kept(rooms_.at(position));
  if (!predicted) return {view.name, view.true_maps};
  if (!view.predicted) {
    LightView seen = *view.true_maps;
    const MapSet maps = predict_(seen.image);
    see_predicted(seen, maps, metres_of(seen, maps.depth));
    view.predicted = std::make_shared<const LightView>(std::move(seen));
  }
  return {view.name, view.predicted};
}

}  // namespace clerestory
