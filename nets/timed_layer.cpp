#include "nets/timed_layer.hpp"

#include <cmath>

#include "host/cl/seconds_of.hpp"
#include "host/error.hpp"
#include "host/math/radiance.hpp"
#include "host/ops/light/surface_points.hpp"
#include "host/ops/tensor/elementwise.hpp"

namespace clerestory {
namespace {

/// Of dL/dI = weight (I - P).
Tensor loss_weight(const Scene& scene) {
  Tensor weight({1, 3, scene.height(), scene.width()});
  const std::size_t n = scene.photo.pixels();
  double count = 0;
  for (const float depth : scene.depth.data) count += 3 * (depth > 0);
  for (std::size_t i = 0; i < weight.real.size(); ++i) {
    const double shown = scene.photo.data[i];
    if (scene.depth.data[i % n] > 0) weight.real[i] = 2 / (shown * shown + kLightFloor) / count;
  }
  return weight;
}

/// Bytes held now, from which on the peak counts.
std::size_t memory_from_here(Device& device) {
  device.finish();
  device.reset_memory_peak();
  return device.memory_now();
}

}  // namespace

TimedLayer::TimedLayer(const Device& device, const Scene& scene, const RenderSettings& settings, LayerResult result,
                       Precision precision, int batches)
    : device_(device), held_before_(memory_from_here(device_)), batches_(batches) {
  if (batches < 1 || settings.spp % batches != 0)
    throw usage_error("these samples do not come in batches of equal size", "spp", std::to_string(settings.spp),
                      fmt::format("a multiple of {}", batches));
  const SceneValues values = scene_values(graph_, scene);
  const SceneLight light =
      scene_light(graph_, values, scene, settings);  // of few rays: none share an answer unless told to
  RenderSettings with_error = settings;  // render_spec() refuses one sample, whose standard error nobody can tell
  with_error.spp = std::max(settings.spp, 2);
  RenderSpec spec = render_spec(with_error, light);
  spec.spp = settings.spp / batches, spec.statistics = false;
  if (result == LayerResult::Picture)
    outputs_ = {{"picture", picture_of(values, light, spec)}};
  else
    add_gradients(values, light, spec, result);

  std::vector<Value> outputs;
  for (const auto& [name, value] : outputs_) outputs.push_back(value);
  executor_.emplace(compile(graph_, outputs, device_, {.precision = precision}), light.states);
  feed_scene(*executor_, scene);
  light.feed(*executor_);
  if (result == LayerResult::Picture) return;
  executor_->feed("target", tensor_of(scene.photo));
  executor_->feed("loss weight", loss_weight(scene));
}

Value TimedLayer::picture_of(const SceneValues& values, const SceneLight& light, const RenderSpec& spec) {
  return render(graph_, spec, values.maps, values.camera, values.range,
                inputs_of(light, surface_points(values.maps.depth, values.camera)), builder_of(light))
      .radiance;
}

void TimedLayer::add_gradients(const SceneValues& values, const SceneLight& light, const RenderSpec& spec,
                               LayerResult result) {
  const Value picture = picture_of(values, light, spec);
  const Value target = graph_.input("target", picture.shape()), weight = graph_.input("loss weight", picture.shape());
  const Value slope = multiply(subtract(picture, target), weight);
  Value varied = picture;  // whose derivatives are taken; what only it needs of the forward pass is pruned
  if (result == LayerResult::TwoDraws) {
    graph_.draws(1);
    varied = picture_of(values, light, spec);
    graph_.draws(0);
  }
  const auto& [albedo, normal, material] = values.maps.surfaces;
  const std::vector<Value> wrt{albedo, normal, material, values.photo};
  const std::vector<Value> found = gradient(std::vector{varied}, std::vector{slope}, wrt);
  outputs_ = {{"albedo", found[0]}, {"normal", found[1]}, {"material", found[2]}, {"radiance", found[3]}};
}

int TimedLayer::traces() const {
  int count = 0;
  for (const Step& step : executor_->plan().steps)
    if (step.body)
      for (const Step& inner : step.body->steps) count += inner.node->op->name() == "ssrt";
  return count;
}

double TimedLayer::run(std::uint32_t seed) {
  if (batches_ == 1) return seconds_of(device_, [&] { executor_->run(seed); });
  added_ = 0;
  return seconds_of(device_, [&] {
    for (int k = 0; k < batches_; ++k) {  // seeds that no other run of as many batches has
      executor_->run(seed * static_cast<std::uint32_t>(batches_) + static_cast<std::uint32_t>(k));
      add_batch();
    }
  });
}

/// Running means and squares (Welford 1962).
void TimedLayer::add_batch() {
  ++added_;
  for (auto& [name, values] : fetched()) {
    std::vector<double>&mean = means_[name], &squares = squares_[name];
    if (added_ == 1) mean.assign(values.size(), 0), squares.assign(values.size(), 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double from_old = values[i] - mean[i];
      mean[i] += from_old / added_;
      squares[i] += from_old * (values[i] - mean[i]);
    }
  }
}

std::map<std::string, std::vector<double>> TimedLayer::values() { return batches_ == 1 ? fetched() : means_; }

std::map<std::string, std::vector<double>> TimedLayer::standard_errors() const {
  if (added_ < 2) throw Error(ErrorKind::Failed, "one batch has no spread", "standard errors of the layer");
  std::map<std::string, std::vector<double>> errors = squares_;
  for (auto& [name, values] : errors)
    for (double& v : values) v = std::sqrt(v / (static_cast<double>(added_) * (added_ - 1)));
  return errors;
}

std::map<std::string, std::vector<double>> TimedLayer::fetched() {
  std::map<std::string, std::vector<double>> values;
  for (const auto& [name, value] : outputs_) values[name] = executor_->fetch(value).real;
  const auto material = values.find("material");
  if (material == values.end()) return values;
  const std::vector<double> all = std::move(material->second);
  values.erase(material);
  const auto plane = static_cast<std::ptrdiff_t>(all.size() / 3);
  values["roughness"].assign(all.begin(), all.begin() + plane);
  values["metallic"].assign(all.begin() + plane, all.begin() + 2 * plane);
  return values;
}

}  // namespace clerestory
