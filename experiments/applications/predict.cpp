#include "experiments/applications/predict.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "experiments/evaluation/prepare.hpp"
#include "experiments/evaluation/real_scale.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "host/graph/states_in.hpp"
#include "host/io/files.hpp"
#include "host/ops/nn/unit_vector.hpp"
#include "host/ops/tensor/joint_bilateral.hpp"
#include "host/report/preview.hpp"
#include "nets/scene_maps.hpp"

namespace clerestory {
namespace {

/// Roughness and metallic with the emission flag, which no net says: 0.
Image with_flag(const Image& material) {
  Image image(material.width, material.height, 3);
  std::ranges::copy(material.data, image.data.begin());
  return image;
}

void clamp_unit(Image& image) {
  for (float& v : image.data) v = std::clamp(v, 0.0f, 1.0f);
}

/// Display values of a picture whose exposure is already right: what the eye compares, and the bilateral with it.
Tensor guide_of(const Image& exposed) { return tensor_of(show_radiance(exposed)); }

/// Rooms like those of training flatter: what was measured on photographs stands beside them.
std::string scale_doubt(const std::filesystem::path& weights, const std::map<std::string, std::string>& metadata) {
  std::string text = "typically off by ";
  if (const auto error = metadata.find("scale_error"); error != metadata.end())
    text += fmt::format("{:.0f} % in generated rooms, ", 100 * std::expm1(std::stod(error->second)));
  const std::optional<RealScale> real = real_scale(weights, file_hash(weights));
  return text + (real ? "by " + real->text() : "by what nobody measured on real photographs");
}

}  // namespace

Prediction predict_maps(Device& device, const std::filesystem::path& weights, const Image& photo,
                        const PredictRequest& request, Precision precision) {
  const LoadedWeights loaded = load_weights(weights, device);
  if (!request.preset.empty() && loaded.preset != request.preset)
    throw usage_error("weights of another preset", weights.string(), loaded.preset, request.preset);
  const int longer = std::max(loaded.size.width, loaded.size.height);
  double exposure = 1;
  const Image small = prepare_photo(photo, longer, &exposure);
  MapPredictor net(device, loaded.net, in_precision(loaded.states, precision), 2, request, precision);
  const MapPrediction said = net.predict({&small}).front();

  Prediction result;
  result.note = fmt::format("{} ({}), at {}x{}", weights.filename().string(), loaded.preset, small.width, small.height);
  result.explanation = net.explain(small.width, small.height);
  if (request.depth) {
    result.scene_scale = std::exp(said.log_scale);
    result.off_by = scale_doubt(weights, loaded.metadata);
  }
  Graph graph;
  const Value guide_low = graph.input("guide low", {1, 3, small.height, small.width});
  const Value guide = graph.input("guide", {1, 3, photo.height, photo.width});
  std::vector<Value> outputs;
  const auto enlarge = [&](bool wanted, const char* name, const Image& map, const JointBilateral& by = {}) {
    if (!wanted) {
      result.left_out.push_back(std::string("decoder of ") + name);
      return Value{};
    }
    const Value input = graph.input(name, {1, map.channels, map.height, map.width});
    return outputs.emplace_back(joint_bilateral(input, guide_low, guide, by));
  };
  const MapSet& maps = said.maps;
  const Value albedo = enlarge(request.albedo, "albedo", maps.albedo),
              material = enlarge(request.material, "material", maps.material);
  const Value depth = enlarge(request.depth, "depth", maps.depth);
  Value normal = enlarge(request.normal, "normal", maps.normal, enlarges_normals);
  if (normal) outputs.back() = normal = unit_vector(normal);

  Executor executor(compile(graph, outputs, device, {.precision = precision}));
  executor.feed("guide low", guide_of(small)), executor.feed("guide", guide_of(scaled(photo, exposure)));
  if (albedo) executor.feed("albedo", tensor_of(maps.albedo));
  if (material) executor.feed("material", tensor_of(maps.material));
  if (depth) executor.feed("depth", tensor_of(maps.depth));
  if (normal) executor.feed("normal", tensor_of(maps.normal));
  executor.run();
  result.explanation += executor.explain();

  if (albedo) clamp_unit(result.albedo = fetch_image(executor, albedo));
  if (normal) result.normal = fetch_image(executor, normal);
  if (material) clamp_unit(result.material = with_flag(fetch_image(executor, material)));
  if (depth) result.depth = fetch_image(executor, depth);
  return result;
}

Image enlarged(Device& device, const Image& map, const Image& mask, const Image& small, const Image& photo,
               const JointBilateral& by) {
  // Weights are the same for all channels: the quotient of a masked map and its mask is a mean over what is known.
  Image masked(map.width, map.height, map.channels + 1);
  for (int c = 0; c <= map.channels; ++c)
    for (std::size_t i = 0; i < map.pixels(); ++i)
      masked.plane(c)[i] = mask.data[i] > 0.5f ? (c < map.channels ? map.plane(c)[i] : 1.0f) : 0.0f;
  Graph graph;
  const Value guide_low = graph.input("guide low", {1, 3, small.height, small.width});
  const Value guide = graph.input("guide", {1, 3, photo.height, photo.width});
  const Value large =
      joint_bilateral(graph.input("map", {1, masked.channels, map.height, map.width}), guide_low, guide, by);
  Executor executor(compile(graph, std::vector{large}, device, {}));
  executor.feed("map", tensor_of(masked));
  executor.feed("guide low", guide_of(small)), executor.feed("guide", guide_of(photo));
  executor.run();
  const Image all = fetch_image(executor, large);
  Image out(photo.width, photo.height, map.channels);
  for (int c = 0; c < map.channels; ++c)
    for (std::size_t i = 0; i < out.pixels(); ++i)
      if (const float weight = all.plane(map.channels)[i]; weight > 0) out.plane(c)[i] = all.plane(c)[i] / weight;
  return out;
}

}  // namespace clerestory
