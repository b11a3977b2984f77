#include "nets/mgnet_training.hpp"

#include <algorithm>

#include "host/ops/nn/moving_average.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "nets/builder.hpp"

namespace clerestory {
namespace {

std::vector<std::string> without_a_term(const LossWeights& w, bool shared_decoder) {
  std::vector<std::string> scopes;
  const auto freeze = [&](const char* scope, bool seen) {
    if (!seen) scopes.push_back(scope);
  };
  const bool albedo = w.albedo > 0 || w.albedo_detail > 0 || w.judgements > 0, normal = w.normal > 0,
             material = w.material > 0 || w.metallic > 0, depth = w.depth > 0 || w.log_depth > 0 || w.depth_detail > 0;
  freeze("decoder_albedo", albedo), freeze("decoder_normal", normal), freeze("decoder_material", material);
  freeze("decoder_depth", depth), freeze("scale", w.scale > 0);
  const bool any = albedo || normal || material || depth;
  if (shared_decoder) freeze("decoder", any);
  freeze("encoder", any);  // the scale's head sees detached features
  return scopes;
}

bool in_encoder(const Value& parameter) { return state_of(parameter).state_name.starts_with("encoder."); }

}  // namespace

MgnetTraining mgnet_training(Graph& graph, const MgnetSize& size, const MgnetTrainingOptions& options) {
  const auto map = [&](const char* name, int channels) {
    return graph.input(name, {options.batch, channels, options.height, options.width});
  };
  const auto per_picture = [&](const char* name) { return graph.input(name, {options.batch, 1, 1, 1}); };
  const Value image = map("image", 3);
  MapTargets truth;
  truth.albedo = map("albedo", 3), truth.normal = map("normal", 3), truth.material = map("material", 2),
  truth.depth = map("depth", 1);
  truth.albedo_mask = map("albedo_mask", 1), truth.geometry_mask = map("geometry_mask", 1),
  truth.material_mask = map("material_mask", 1);
  truth.log_scale = per_picture("log_scale"), truth.scale_mask = per_picture("scale_mask");
  if (options.judgements > 0) {
    const Shape pairs{1, 1, options.batch, options.judgements};
    truth.judged = {graph.input("judged_first", pairs, Type::Int), graph.input("judged_second", pairs, Type::Int),
                    graph.input("judged_equal", pairs), graph.input("judged_ordered", pairs)};
  }
  const Value rate = graph.input("learning_rate", {}), step = graph.input("step", {});

  MgnetTraining training;
  training.maps = mgnet(graph, image, size, true);
  training.losses = mgnet_losses({graph, true, ""}, training.maps, truth, options.weights);
  training.frozen = without_a_term(options.weights, size.shared());
  std::vector<Value> parameters = trained_parameters(graph, training.frozen);
  const auto decoders = std::stable_partition(parameters.begin(), parameters.end(), in_encoder);
  const std::vector<Value> gradients = gradient(training.losses.front().second, parameters);
  const auto encoder = static_cast<std::size_t>(decoders - parameters.begin());
  const std::span<const Value> all(parameters), slopes(gradients);
  std::vector<Value> squares;
  if (encoder > 0)
    squares.push_back(
        adam(all.first(encoder), slopes.first(encoder), scale(rate, options.encoder_rate), step, options.adam));
  if (encoder < all.size())
    squares.push_back(adam(all.subspan(encoder), slopes.subspan(encoder), rate, step, options.adam));
  training.squares = concat(squares);
  if (options.average > 0) moving_average(all, step, options.average);
  training.parameters = std::move(parameters);
  return training;
}

}  // namespace clerestory
