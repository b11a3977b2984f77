#include "experiments/training/batches.hpp"

#include <algorithm>
#include <cmath>

#include "experiments/training/keyed.hpp"
#include "experiments/training/photo.hpp"

namespace clerestory {
namespace {

enum Purpose : std::uint64_t { flip_draw = 2, exposure_draw = 3, photo_draw = 4, camera_draw = 5 };

void append(std::vector<float>& to, const Image& map, bool flip, bool repeat) {
  const Image padded = pad_to_multiple(flip ? mirrored(map) : map, net_multiple, repeat);
  to.insert(to.end(), padded.data.begin(), padded.data.end());
}

}  // namespace

TrainingBatch assemble_batch(const std::vector<PreparedView>& views, const std::vector<bool>& flip,
                             const std::vector<double>& gain) {
  TrainingBatch batch;
  batch.n = static_cast<int>(views.size());
  batch.w = padded_size(views.at(0).image.width), batch.h = padded_size(views[0].image.height);
  for (std::size_t k = 0; k < views.size(); ++k) {
    const PreparedView& view = views[k];
    Image normal = view.truth.normal, depth = view.truth.depth;
    if (flip[k])
      for (std::size_t i = 0; i < normal.pixels(); ++i) normal.data[i] = -normal.data[i];
    for (float& d : depth.data) d = std::min(d, 1.0f);
    const Image input = net_input(flip[k] ? mirrored(view.image) : view.image, gain[k]);
    batch.image.insert(batch.image.end(), input.data.begin(), input.data.end());
    append(batch.albedo, view.truth.albedo, flip[k], false);
    append(batch.normal, normal, flip[k], false);
    append(batch.material, view.truth.material, flip[k], false);
    append(batch.depth, depth, flip[k], false);
    append(batch.geometry_mask, view.masks.geometry, flip[k], false);
    append(batch.albedo_mask, view.masks.albedo, flip[k], false);
    append(batch.material_mask, view.masks.material, flip[k], false);
    batch.scale_mask.push_back(view.scene_scale > 0 ? 1.0f : 0.0f);
    batch.log_scale.push_back(view.scene_scale > 0 ? static_cast<float>(std::log(view.scene_scale)) : 0.0f);
  }
  return batch;
}

TrainingBatch training_batch(TrainingViews& from, const Augmentation& augmentation, std::uint64_t seed,
                             std::int64_t first, std::int64_t step, int batch) {
  std::vector<PreparedView> views;
  std::vector<bool> flip;
  std::vector<double> gain;
  std::vector<std::string> names;
  for (int k = 0; k < batch; ++k) {
    const auto position = static_cast<std::uint64_t>(first + step * batch + k);
    NamedView view = from.at(position);
    if (keyed_uniform(seed, position, photo_draw) < augmentation.photographs)
      view.view.image = as_photographed(view.view.image, keyed_bits(seed, position, camera_draw));
    views.push_back(std::move(view.view));
    names.push_back(std::move(view.name));
    flip.push_back(augmentation.flip && keyed_uniform(seed, position, flip_draw) < 0.5);
    const double target = augmentation.exposure_low + (augmentation.exposure_high - augmentation.exposure_low) *
                                                          keyed_uniform(seed, position, exposure_draw);
    gain.push_back(target / 0.9);
  }
  TrainingBatch out = assemble_batch(views, flip, gain);
  out.step = step;
  out.views = std::move(names);
  return out;
}

std::unique_ptr<BatchStream> batch_stream(TrainingViews& views, const Augmentation& augmentation, std::uint64_t seed,
                                          std::int64_t first, int batch, std::int64_t first_step) {
  return std::make_unique<BatchStream>(
      [&views, augmentation, seed, first, batch](std::int64_t step) {
        return training_batch(views, augmentation, seed, first, step, batch);
      },
      first_step);
}

}  // namespace clerestory
