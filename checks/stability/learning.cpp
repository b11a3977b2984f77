// What training computes: losses, normalisations, the optimiser, and what nets answer before they have learned.
#include <array>
#include <cmath>

#include "checks/stability/stability_case.hpp"
#include "host/math/radiance.hpp"
#include "host/ops/nn/adam.hpp"
#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/group_norm.hpp"
#include "host/ops/nn/map_loss.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "nets/light_training.hpp"
#include "nets/out_of_view.hpp"

namespace clerestory {
namespace {

// ---- Losses ---------------------------------------------------------------------------------------------------------

const Shape kColours{1, 3, 32, 64}, kMask{1, 1, 32, 64};

/// Numbers within a factor of ten of a size.
Tensor about(double size, std::uint64_t seed) {
  return {kColours, spread_logarithms(static_cast<int>(kColours.count()), size / 10, size * 10, seed)};
}

using Loss = std::function<Value(Value, Value, Value)>;

StabilityCase lost(const std::string& name, const Loss& loss, const Tensor& prediction, const Tensor& truth,
                   double mask = 1) {
  Formula f{.inputs = {{"prediction", prediction}, {"truth", truth}, {"mask", Tensor(kMask, mask)}}};
  f.build = [loss](Graph&, const Values& v) {
    return std::vector<Compared>{{loss(v.at("prediction"), v.at("truth"), v.at("mask"))}};
  };
  f.differentiate = {"prediction"};
  return case_of("losses", name, f);
}

/// The scale that brings predictions to the truth.
StabilityCase scaled(const std::string& name, double prediction, double truth, double mask) {
  Formula f{
      .inputs = {{"prediction", about(prediction, 3)}, {"truth", about(truth, 4)}, {"mask", Tensor(kMask, mask)}}};
  f.build = [](Graph&, const Values& v) {
    return std::vector<Compared>{{least_squares_scale(v.at("prediction"), v.at("truth"), v.at("mask")), false}};
  };
  return case_of("losses", name, f);
}

// ---- Normalisations -------------------------------------------------------------------------------------------------

Formula normalisation(const Tensor& x) {
  const Shape channels{1, x.shape.c, 1, 1};
  return {
      .inputs = {{"x", x}, {"gamma", random_tensor(channels, 5, 0.5, 1.5)}, {"beta", random_tensor(channels, 6, 1, 2)}},
      .differentiate = {"x", "gamma", "beta"}};
}

StabilityCase by_batch(const std::string& name, const Tensor& x) {
  Formula f = normalisation(x);
  f.build = [](Graph&, const Values& v) {
    return std::vector<Compared>{
        {normalise_channels(v.at("x"), channel_moments(v.at("x")), v.at("gamma"), v.at("beta"), false)}};
  };
  return case_of("norms", "batch norm, " + name, f);
}

StabilityCase by_group(const std::string& name, const Tensor& x) {
  Formula f = normalisation(x);
  f.build = [](Graph&, const Values& v) {
    return std::vector<Compared>{{group_norm(v.at("x"), v.at("gamma"), v.at("beta"), 4, false)}};
  };
  return case_of("norms", "group norm, " + name, f);
}

// ---- Optimiser ------------------------------------------------------------------------------------------------------

StabilityCase updated(const std::string& name, const Tensor& gradient, double step, const Tensor& first,
                      const Tensor& second) {
  const Shape shape = gradient.shape;
  Formula f{.inputs = {{"gradient", gradient}, {"rate", Tensor({}, 5e-4)}, {"step", Tensor({}, step)}},
            .states = {{"adam.m.p", first}, {"adam.v.p", second}, {"p", random_tensor(shape, 4, 0.5, 1)}}};
  f.build = [shape](Graph& g, const Values& v) {
    const std::vector<Value> p{g.state("p", shape, Init::constant(0))}, gradients{v.at("gradient")};
    adam(p, gradients, v.at("rate"), v.at("step"));
    return std::vector<Compared>{};
  };
  return case_of("optimiser", "Adam, " + name, f);
}

// ---- Nets at their start --------------------------------------------------------------------------------------------

/// A hypernetwork that has not learned: what it writes and, with `most`, the light of the field that it writes.
StabilityCase unlearned(const std::string& name, const OutOfViewSize& size, const Tensor& image, double most = 0) {
  const Shape rays{1, 3, 64, 16};
  Formula f{.inputs = {{"image", image},
                       {"points", random_tensor(rays, 1, -1, 1)},
                       {"directions", random_tensor(rays, 2)},
                       {"range", Tensor(Shape{1, 3, 1, 1}, 2)}}};
  f.build = [size, most](Graph& g, const Values& v) {
    LightInputs pictures;
    pictures.image = v.at("image"), pictures.range = v.at("range");
    const LightField field = light_fields({g, true, "global"}, pictures, size).front();
    if (most > 0)
      return std::vector<Compared>{
          {out_of_view_light(field, v.at("points"), v.at("directions"), v.at("range"), size), false}};
    std::vector<Compared> written;
    for (std::size_t i = 0; i < field.weights.size(); ++i) {  // what a neuron adds up is one vector
      const Value weights = field.weights[i], biases = reshape(field.biases[i], {weights.shape().n, 1, 1, 1});
      written.push_back({concat(std::array{weights, biases}), false});
    }
    return written;
  };
  StabilityCase c = case_of("hypernetwork", name, f);
  if (most > 0) c.most = most;
  return c;
}

}  // namespace

std::vector<StabilityCase> loss_stability() {
  const auto hdr = [](Value p, Value t, Value m) { return hdr_loss(p, t, m); };
  const auto relative = [](Value p, Value t, Value m) { return relative_loss(p, t, m); };
  const auto squared = [](Value p, Value t, Value m) { return squared_loss(p, t, m); };
  const auto logarithmic = [](Value p, Value t, Value m) { return log_loss(p, t, m); };
  const auto cosine = [](Value p, Value t, Value m) { return cosine_loss(p, t, m); };
  std::vector<StabilityCase> cases;
  for (const double size : {1e-30, 1e-6, 1.0, 1e6, 1e15})
    cases.push_back(lost(fmt::format("RawNeRF's, radiance {:g}", size), hdr, about(size, 1), about(size, 2)));
  for (const double size : {1e-30, 1e-6, 0.01, 1.0, 1e6, 1e15}) {
    cases.push_back(lost(fmt::format("relative, radiance {:g}", size), relative, about(size, 1), about(size, 2)));
    cases.back().inside = size >= kLightFloor;
  }
  const Tensor nothing(kColours, 0);
  cases.push_back(lost("RawNeRF's, nothing predicted of 1e10", hdr, nothing, about(1e10, 2)));
  cases.push_back(lost("RawNeRF's, 1e10 predicted of nothing", hdr, about(1e10, 1), nothing));
  for (const auto& [name, loss] : {std::pair<std::string, Loss>{"RawNeRF's", hdr},
                                   {"squared", squared},
                                   {"logarithmic", logarithmic},
                                   {"cosine", cosine}}) {
    cases.push_back(lost(name + ", an empty mask", loss, about(1, 1), about(1, 2), 0));
    cases.back().black = true;
  }
  cases.push_back(lost("logarithmic, 1e6", logarithmic, about(1e6, 1), about(1e6, 2)));
  cases.push_back(lost("squared, 1e-15", squared, about(1e-15, 1), about(1e-15, 2)));
  cases.push_back(scaled("least squares, an empty mask", 1, 1, 0));
  cases.push_back(scaled("least squares of 1e-6", 1e-6, 1, 1));
  cases.push_back(scaled("least squares of 1e6", 1e6, 1, 1));
  return cases;
}

std::vector<StabilityCase> norm_stability() {
  const Shape one{1, 16, 1, 1}, plane{1, 16, 12, 10};
  const auto by_channel = [](const Shape& s, double size) {
    Tensor x(s);
    const Tensor values = random_tensor({1, s.c, 1, 1}, 8, 0.5 * size, size);
    for (int c = 0; c < s.c; ++c)
      for (int y = 0; y < s.h; ++y)
        for (int k = 0; k < s.w; ++k) x.at(0, c, y, k) = values.real[static_cast<std::size_t>(c / 4 * 4)];
    return x;
  };
  const auto beside = [&](double mean) {
    Tensor x = random_tensor(plane, 7);
    for (double& v : x.real) v += mean;
    return x;
  };
  std::vector<StabilityCase> cases{by_batch("one number a channel", random_tensor(one, 7)),
                                   by_batch("batch 1", random_tensor(plane, 7)),
                                   by_batch("one value a channel, to 1", by_channel(plane, 1)),
                                   by_batch("one value a channel, to 1e4", by_channel(plane, 1e4)),
                                   by_batch("mean 6, deviation 0.6", beside(6)),
                                   by_group("one value a group, 0", Tensor(plane, 0)),
                                   by_group("one value a group, to 1", by_channel(plane, 1)),
                                   by_group("one value a group, to 1e4", by_channel(plane, 1e4)),
                                   by_group("mean 6, deviation 0.6", beside(6)),
                                   outside(by_batch("mean 600, deviation 0.6", beside(600))),
                                   outside(by_group("mean 600, deviation 0.6", beside(600)))};
  return cases;
}

std::vector<StabilityCase> optimiser_stability() {
  const Shape shape{64, 64, 1, 1};
  const Tensor none(shape, 0), usual = random_tensor(shape, 1), first = random_tensor(shape, 2, 0.1, 1),
                               second = random_tensor(shape, 3, 0.1, 1);
  const auto of_size = [&](double size) {
    return Tensor(shape, spread_logarithms(static_cast<int>(shape.count()), size / 10, size * 10, 5));
  };
  return {updated("zero gradients from the start", none, 1, none, none),
          updated("zero gradients after 1e6 steps", none, 1e6, first, second),
          updated("zero gradients after 1e6 steps of them", none, 1e6, none, none),
          updated("usual gradients after 1e6 steps", usual, 1e6, first, second),
          updated("gradients of 1e-30", of_size(1e-30), 1, none, none),
          updated("gradients of 1e15", of_size(1e15), 1, none, none)};
}

std::vector<StabilityCase> hypernetwork_stability() {
  const OutOfViewSize low_rank = out_of_view_size("compact");
  const OutOfViewSize paper{.trunk = {.channels = {16, 32, 64, 64}}, .stem = 64, .inner = 128};
  const Shape picture{1, 3, 48, 64};
  const Tensor usual = random_tensor(picture, 3, 0, 1), dark(picture, 0);
  constexpr double most = 10;  // in units of the photograph's white
  std::vector<StabilityCase> cases;
  for (const auto& [name, size] : {std::pair{"low rank", low_rank}, {"as in the paper", paper}}) {
    cases.push_back(unlearned(fmt::format("{}, weights that it writes", name), size, usual));
    cases.push_back(unlearned(fmt::format("{}, weights that it writes of a dark picture", name), size, dark));
    cases.push_back(unlearned(fmt::format("{}, light of their field", name), size, usual, most));
    cases.push_back(unlearned(fmt::format("{}, light of their field of a dark picture", name), size, dark, most));
  }
  return cases;
}

}  // namespace clerestory
