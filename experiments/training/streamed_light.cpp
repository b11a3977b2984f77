#include "experiments/training/streamed_light.hpp"

namespace clerestory {

StreamedLight::StreamedLight(const StreamOptions& options, Size size, std::uint64_t seed, std::uint64_t first,
                             Predict predict)
    : size_(size), predict_(std::move(predict)), rooms_(options, seed, first), recent_(views_in_window(options)) {}

NamedLightView StreamedLight::at(std::uint64_t position, bool predicted) {
  const ViewName name = rooms_.at(position);
  Kept& view = recent_.get(name.text(), [&] {
    return Kept{std::make_shared<const LightView>(read_light_view(name, size_.width, size_.height)), nullptr};
  });
  if (!predicted) return {name.text(), view.true_maps};
  if (!view.predicted) {
    LightView seen = *view.true_maps;
    const MapSet maps = predict_(seen.image);
    see_predicted(seen, maps, metres_of(seen, maps.depth));
    view.predicted = std::make_shared<const LightView>(std::move(seen));
  }
  return {name.text(), view.predicted};
}

}  // namespace clerestory
