#include "experiments/training/network.hpp"

#include <cstdio>
#include <set>
#include <utility>

#include "experiments/weights/imported.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/stored_states.hpp"
#include "experiments/weights/weights.hpp"
#include "host/error.hpp"
#include "nets/mgnet_training.hpp"

namespace clerestory {
namespace {

/// Features of rooms are those of the encoder of these weights.
PerceptualFeatures with_encoder(PerceptualFeatures features, const std::string& path) {
  if (features.from != PerceptualFeatures::From::Rooms) return features;
  features.encoder = read_maps_size(path);
  if (features.encoder.li2020())
    throw usage_error("the net of Li et al. has no encoder that maps are looked at through", "loss.perceptual_weights",
                      path, "weights of MGNet's maps");
  return features;
}

/// Sets what the perceptual term looks through; random features are there already.
void set_frozen_features(const LossSection& loss, States& states) {
  using From = PerceptualFeatures::From;
  const PerceptualFeatures& features = loss.weights.features;
  const std::string& path = loss.perceptual_weights;
  if (loss.weights.perceptual == 0 || features.from == From::Random) return;
  const bool rooms = features.from == From::Rooms;
  const TensorFile file = rooms ? read_finite_safetensors(path) : read_imported(path, "vgg16");
  // "rooms.encoder.stem.weight" is "encoder.stem.weight" in its file; VGG16's files have our names.
  const std::size_t before = rooms ? std::string(features.scope()).size() + 1 : 0;
  for (const std::string& name : states.names()) {
    if (!is_frozen_feature(name)) continue;
    const Shape shape = states.view(name).shape;
    const std::string stored = name.substr(before);
    states.set(name, Tensor(shape, shaped_tensor(file, stored, shape, path).floats(path + ": " + stored)));
  }
}

}  // namespace

PlanOptions plan_options(const TrainingOptions& options) {
  PlanOptions plan;
  plan.budget = options.train.memory, plan.budget_name = options.train.memory_key;
  return plan;
}

StepResult result_of(Executor& run, const NamedValues& losses, const std::vector<Value>& parameters, Value squares) {
  StepResult result;
  for (const auto& [name, value] : losses) result.losses.emplace_back(name, run.fetch(value).real.at(0));
  const std::vector<double> sums = run.fetch(squares).real;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    result.parameters.push_back({state_of(parameters[i]).state_name, sums.at(2 * i), sums.at(2 * i + 1)});
  return result;
}

struct TrainingNetwork::State {
  Graph graph;
  MgnetTraining training;
  std::unique_ptr<Executor> run;
  std::size_t parameters = 0;
  int judgements = 0;  // that a picture brings at most
};

TrainingNetwork::TrainingNetwork(Device device, const TrainingOptions& o, std::shared_ptr<States> states)
    : state_(std::make_unique<State>()) {
  MgnetTrainingOptions options;
  options.batch = o.train.batch, options.height = padded_size(o.model.size.height),
  options.width = padded_size(o.model.size.width);
  options.weights = o.loss.weights;
  if (options.weights.judgements > 0) options.judgements = 2 * static_cast<int>(kMostJudgements);
  if (options.weights.perceptual > 0)
    options.weights.features = with_encoder(options.weights.features, o.loss.perceptual_weights);
  options.encoder_rate = o.train.encoder_rate;
  options.adam.beta1 = o.train.beta1, options.adam.beta2 = o.train.beta2, options.average = o.train.average;
  state_->judgements = options.judgements;
  state_->training = mgnet_training(state_->graph, o.model.net, options);
  states->initialise(state_->graph, o.run.seed);
  set_frozen_features(o.loss, *states);
  std::vector<Value> outputs;
  for (const auto& [name, value] : state_->training.losses) outputs.push_back(value);
  outputs.push_back(state_->training.squares);
  for (const Value& p : state_->graph.parameters()) state_->parameters += static_cast<std::size_t>(p.shape().count());
  state_->run =
      std::make_unique<Executor>(compile(state_->graph, outputs, device, plan_options(o), true), std::move(states));
}

TrainingNetwork::~TrainingNetwork() = default;

namespace {

/// What people say in a batch as the graph takes it: first pixels, second ones, weights of those that are equal and of
/// those that are not. Each photograph that brings any counts as much.
void feed_judgements(Executor& run, const TrainingBatch& batch, int each) {
  const Shape shape{1, 1, batch.n, each};
  const auto count = static_cast<std::size_t>(shape.count());
  std::vector<int> first(count, -1), second(count, -1);
  std::vector<float> equal(count), ordered(count);
  std::set<int> photographs;
  for (const JudgedPixels& j : batch.judged) photographs.insert(j.darker / (batch.h * batch.w));
  const float share = photographs.empty() ? 0 : 1 / static_cast<float>(photographs.size());
  for (std::size_t i = 0; i < batch.judged.size(); ++i) {
    const JudgedPixels& j = batch.judged[i];
    first[i] = j.darker, second[i] = j.other, (j.equal ? equal : ordered)[i] = share * j.weight;
  }
  run.feed("judged_first", Tensor::of_int(shape, std::move(first)));
  run.feed("judged_second", Tensor::of_int(shape, std::move(second)));
  run.feed("judged_equal", equal), run.feed("judged_ordered", ordered);
}

}  // namespace

StepResult TrainingNetwork::step(const TrainingBatch& batch, double rate) {
  Executor& run = *state_->run;
  run.feed("image", batch.image);
  run.feed("albedo", batch.albedo);
  run.feed("normal", batch.normal);
  run.feed("material", batch.material);
  run.feed("depth", batch.depth);
  run.feed("albedo_mask", batch.albedo_mask);
  run.feed("geometry_mask", batch.geometry_mask);
  run.feed("material_mask", batch.material_mask);
  run.feed("log_scale", batch.log_scale);
  run.feed("scale_mask", batch.scale_mask);
  if (state_->judgements > 0) feed_judgements(run, batch, state_->judgements);
  run.feed("learning_rate", Tensor({}, rate));
  run.feed("step", Tensor({}, static_cast<double>(batch.step + 1)));
  run.run();
  return result_of(run, state_->training.losses, state_->training.parameters, state_->training.squares);
}

std::size_t TrainingNetwork::parameters() const { return state_->parameters; }
std::size_t TrainingNetwork::bytes() const { return state_->run->bytes(); }
const std::vector<std::string>& TrainingNetwork::frozen() const { return state_->training.frozen; }

std::string frozen_note(const std::vector<std::string>& scopes) {
  if (scopes.empty()) return {};
  return fmt::format("not trained, as no term with a weight sees them: {}", fmt::join(scopes, ", "));
}

}  // namespace clerestory
