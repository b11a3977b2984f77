#include "experiments/training/batches.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <utility>

#include "experiments/training/keyed.hpp"
#include "experiments/training/new_paint.hpp"
#include "experiments/training/photo.hpp"

namespace clerestory {
namespace {

enum Purpose : std::uint64_t {
  flip_draw = 2,
  exposure_draw = 3,
  photo_draw = 4,
  camera_draw = 5,
  paint_draw = 6,
  colours_draw = 7
};

void append(std::vector<float>& to, const Image& map, bool flip, bool repeat) {
  const Image padded = pad_to_multiple(flip ? mirrored(map) : map, net_multiple, repeat);
  to.insert(to.end(), padded.data.begin(), padded.data.end());
}

/// Puts the views of `more`, of the same size, behind those of `batch`.
void append(TrainingBatch& batch, const TrainingBatch& more) {
  for (JudgedPixels pair : more.judged) {
    pair.darker += batch.n * more.h * more.w, pair.other += batch.n * more.h * more.w;
    batch.judged.push_back(pair);
  }
  batch.n += more.n, batch.w = more.w, batch.h = more.h;
  for (auto member : {&TrainingBatch::image, &TrainingBatch::albedo, &TrainingBatch::normal, &TrainingBatch::material,
                      &TrainingBatch::depth, &TrainingBatch::geometry_mask, &TrainingBatch::albedo_mask,
                      &TrainingBatch::material_mask, &TrainingBatch::log_scale, &TrainingBatch::scale_mask})
    (batch.*member).insert((batch.*member).end(), (more.*member).begin(), (more.*member).end());
  batch.views.insert(batch.views.end(), more.views.begin(), more.views.end());
}

/// The view of a position as the net is given it.
TrainingBatch batch_of_one(const MakeView& make, const Augmentation& augmentation, std::uint64_t seed,
                           std::uint64_t position) {
  NamedView view = make();
  if (!view.photograph && keyed_uniform(seed, position, paint_draw) < augmentation.painted)
    paint_anew(view.view, keyed_bits(seed, position, colours_draw));
  if (!view.photograph && keyed_uniform(seed, position, photo_draw) < augmentation.photographs)
    view.view.image = as_photographed(view.view.image, keyed_bits(seed, position, camera_draw));
  const bool flip = augmentation.flip && keyed_uniform(seed, position, flip_draw) < 0.5;
  const double target = augmentation.exposure_low + (augmentation.exposure_high - augmentation.exposure_low) *
                                                        keyed_uniform(seed, position, exposure_draw);
  TrainingBatch one = assemble_batch(view.view, flip, target / 0.9);
  one.views = {std::move(view.name)};
  return one;
}

}  // namespace

TrainingBatch assemble_batch(const PreparedView& view, bool flip, double gain) {
  TrainingBatch batch;
  batch.n = 1;
  batch.w = padded_size(view.image.width), batch.h = padded_size(view.image.height);
  Image depth = view.truth.depth;
  for (float& d : depth.data) d = std::min(d, 1.0f);
  batch.image = net_input(flip ? mirrored(view.image) : view.image, gain).data;
  append(batch.albedo, view.truth.albedo, flip, false);
  append(batch.normal, flip ? mirrored_normals(view.truth.normal) : view.truth.normal, false, false);
  append(batch.material, view.truth.material, flip, false);
  append(batch.depth, depth, flip, false);
  append(batch.geometry_mask, view.masks.geometry, flip, false);
  append(batch.albedo_mask, view.masks.albedo, flip, false);
  append(batch.material_mask, view.masks.material, flip, false);
  const int width = view.image.width;
  const auto padded = [&](int pixel) {
    const int x = pixel % width, y = pixel / width;
    return y * batch.w + (flip ? width - 1 - x : x);
  };
  for (const JudgedPixels& j : view.judged)
    batch.judged.push_back({padded(j.darker), padded(j.other), j.equal, j.weight});
  batch.scale_mask = {view.scene_scale > 0 ? 1.0f : 0.0f};
  batch.log_scale = {view.scene_scale > 0 ? static_cast<float>(std::log(view.scene_scale)) : 0.0f};
  return batch;
}

std::future<TrainingBatch> begin_batch(TrainingViews& from, const Augmentation& augmentation, std::uint64_t seed,
                                       std::int64_t first, std::int64_t step, int batch) {
  std::vector<std::future<TrainingBatch>> views;
  for (int k = 0; k < batch; ++k) {
    const auto position = static_cast<std::uint64_t>(first + step * batch + k);
    views.push_back(std::async(std::launch::async, [augmentation, seed, position, make = from.at(position)] {
      return batch_of_one(make, augmentation, seed, position);
    }));
  }
  return std::async(std::launch::async, [step, views = std::move(views)]() mutable {
    TrainingBatch out;
    out.step = step;
    for (std::future<TrainingBatch>& view : views) append(out, view.get());
    return out;
  });
}

BatchStream::BatchStream(TrainingViews& views, const Augmentation& augmentation, std::uint64_t seed, std::int64_t first,
                         int batch, std::int64_t first_step)
    : begun_([&views, augmentation, seed, first,
              batch](std::int64_t step) { return begin_batch(views, augmentation, seed, first, step, batch); },
             first_step) {}

}  // namespace clerestory
