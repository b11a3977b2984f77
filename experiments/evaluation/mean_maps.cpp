#include "experiments/evaluation/mean_maps.hpp"

#include <algorithm>
#include <cmath>

#include "host/error.hpp"

namespace clerestory {
namespace {

constexpr std::size_t cells = static_cast<std::size_t>(MeanMaps::grid_width) * MeanMaps::grid_height;

}  // namespace

MeanMaps::MeanMaps() : sum_(channels * cells, 0.0), weight_(channels * cells, 0.0) {}

void MeanMaps::add(const PreparedView& view) {
  const Image& depth = view.truth.depth;
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * depth.width + x;
      const std::size_t cell = static_cast<std::size_t>(y) * grid_height / depth.height * grid_width +
                               static_cast<std::size_t>(x) * grid_width / depth.width;
      const auto add_value = [&](int channel, double value) {
        sum_[channel * cells + cell] += value;
        weight_[channel * cells + cell] += 1;
      };
      const bool geometry = view.masks.geometry.data[pixel] > 0.5f;
      for (int c = 0; c < 3; ++c) {
        if (view.masks.albedo.data[pixel] > 0.5f) add_value(c, view.truth.albedo.plane(c)[pixel]);
        if (geometry) add_value(3 + c, view.truth.normal.plane(c)[pixel]);
      }
      if (geometry) add_value(6, std::log(std::max<double>(depth.data[pixel], least_relative_depth)));
      if (view.masks.material.data[pixel] > 0.5f)
        for (int c = 0; c < 2; ++c) add_value(7 + c, view.truth.material.plane(c)[pixel]);
    }
  ++views_;
}

MapSet MeanMaps::maps(int width, int height) const {
  if (views_ == 0) throw Error(ErrorKind::Failed, "no view was added", "mean maps");
  Image mean(grid_width, grid_height, channels);
  for (int c = 0; c < channels; ++c) {
    double total = 0, weight = 0;
    for (std::size_t i = 0; i < cells; ++i) total += sum_[c * cells + i], weight += weight_[c * cells + i];
    const double overall = weight > 0 ? total / weight : 0;
    for (std::size_t i = 0; i < cells; ++i) {
      const double w = weight_[c * cells + i];
      mean.plane(c)[i] = static_cast<float>(w > 0 ? sum_[c * cells + i] / w : overall);
    }
  }
  const Image big = resize_area(mean, width, height);
  MapSet out{Image(width, height, 3), Image(width, height, 3), Image(width, height, 1), Image(width, height, 2)};
  const std::size_t pixels = big.pixels();
  std::copy_n(big.plane(0), 3 * pixels, out.albedo.data.begin());
  std::copy_n(big.plane(3), 3 * pixels, out.normal.data.begin());
  std::copy_n(big.plane(7), 2 * pixels, out.material.data.begin());
  for (std::size_t i = 0; i < pixels; ++i) {
    out.depth.data[i] = std::exp(big.plane(6)[i]);
    const float x = out.normal.plane(0)[i], y = out.normal.plane(1)[i], z = out.normal.plane(2)[i];
    const float length = std::sqrt(x * x + y * y + z * z);
    if (length > 0)
      for (int c = 0; c < 3; ++c) out.normal.plane(c)[i] /= length;
  }
  return out;
}

void MeanMaps::store(TensorFile& file) const {
  std::vector<float> mean(channels * cells, 0), known(channels * cells, 0);
  for (std::size_t i = 0; i < mean.size(); ++i)
    if (weight_[i] > 0) mean[i] = static_cast<float>(sum_[i] / weight_[i]), known[i] = 1;
  file.tensors["mean_maps.mean"] = StoredTensor({channels, grid_height, grid_width}, std::move(mean));
  file.tensors["mean_maps.known"] = StoredTensor({channels, grid_height, grid_width}, std::move(known));
  file.metadata["mean_maps.views"] = std::to_string(views_);
}

MeanMaps MeanMaps::restore(const TensorFile& file, const std::string& where) {
  const std::vector<long> shape{channels, grid_height, grid_width};
  const StoredTensor& mean = file.get("mean_maps.mean", where);
  const StoredTensor& known = file.get("mean_maps.known", where);
  if (mean.shape != shape || known.shape != shape)
    throw usage_error("mean maps of another shape", where, fmt::format("{}", fmt::join(mean.shape, "x")),
                      fmt::format("{}", fmt::join(shape, "x")));
  MeanMaps out;
  const auto views = file.metadata.find("mean_maps.views");
  out.views_ = views == file.metadata.end() ? 1 : std::max(1L, std::strtol(views->second.c_str(), nullptr, 10));
  out.weight_.assign(known.floats(where).begin(), known.floats(where).end());
  out.sum_.assign(mean.floats(where).begin(), mean.floats(where).end());
  for (std::size_t i = 0; i < out.sum_.size(); ++i) {
    if (!std::isfinite(out.sum_[i])) throw usage_error("a mean map holds a value that is not finite", where);
    out.sum_[i] *= out.weight_[i];
  }
  return out;
}

MeanMaps MeanMaps::as_stored() const {
  TensorFile file;
  store(file);
  return restore(file, "mean maps");
}

}  // namespace clerestory
