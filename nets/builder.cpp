#include "nets/builder.hpp"

#include <algorithm>
#include <cmath>

#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/depthwise.hpp"
#include "host/ops/nn/group_norm.hpp"

namespace clerestory {
namespace {

double fan_in(Value x, int kernel) { return static_cast<double>(x.shape().c) * kernel * kernel; }

Value he_weight(const Scope& scope, Value x, int out, int kernel) {
  return scope.state("weight", {out, x.shape().c, kernel, kernel}, Init::normal(std::sqrt(2 / fan_in(x, kernel))));
}

/// The states and moments that normalise x; in training their update is appended.
ConvNorm batch_norm(const Scope& scope, const Feature& x) {
  const Shape& s = x.value.shape();
  const Shape per_channel{1, s.c, 1, 1};
  ConvNorm norm;
  norm.gamma = scope.state("weight", per_channel, Init::constant(1));
  norm.beta = scope.state("bias", per_channel, Init::constant(0));
  const Value mean = scope.state("running_mean", per_channel, Init::fixed(0));
  const Value variance = scope.state("running_var", per_channel, Init::fixed(1));
  if (scope.training) update_running(x.moments, mean, variance, s.n * s.plane());
  norm.moments = scope.training ? x.moments : running_moments(mean, variance);
  return norm;
}

}  // namespace

std::vector<Value> trained_parameters(const Graph& graph, const std::vector<std::string>& frozen) {
  std::vector<Value> parameters = graph.parameters();
  std::erase_if(parameters, [&](const Value& v) {
    const std::string& name = state_of(v).state_name;
    return std::ranges::any_of(frozen, [&](const std::string& scope) { return name.starts_with(scope + "."); });
  });
  return parameters;
}

Value conv_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad) {
  return conv(x, he_weight(scope, x, out, kernel), {}, {.stride = stride, .pad = pad});
}

Value conv_bias_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad) {
  const Init init = Init::uniform(1 / std::sqrt(fan_in(x, kernel)));
  const Value weight = scope.state("weight", {out, x.shape().c, kernel, kernel}, init);
  const Value bias = scope.state("bias", {1, out, 1, 1}, init);
  return conv(x, weight, bias, {.stride = stride, .pad = pad});
}

Value conv_shift_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad) {
  const Value weight = he_weight(scope, x, out, kernel);
  return conv(x, weight, scope.state("bias", {1, out, 1, 1}, Init::constant(0)), {.stride = stride, .pad = pad});
}

Value depthwise_layer(const Scope& scope, Value x, int kernel, int stride) {
  const int channels = x.shape().c;
  const Value weight = scope.state("weight", {channels, 1, kernel, kernel}, Init::normal(std::sqrt(2.0) / kernel));
  return depthwise(x, weight, scope.state("bias", {1, channels, 1, 1}, Init::constant(0)), stride);
}

Feature feature_of(const Scope& scope, Value value) {
  return {value, scope.training ? channel_moments(value) : Value{}};
}

Value batch_norm_layer(const Scope& scope, const Feature& x, bool relu) {
  const ConvNorm norm = batch_norm(scope, x);
  return normalise_channels(x.value, norm.moments, norm.gamma, norm.beta, relu, norm.epsilon);
}

Value norm_conv_layer(const Scope& norm, const Scope& scope, const Feature& x, int out, int kernel, int stride,
                      int pad) {
  return conv(x.value, batch_norm(norm, x), he_weight(scope, x.value, out, kernel), {}, {.stride = stride, .pad = pad});
}

Value group_norm_relu_layer(const Scope& scope, Value x, int groups) {
  const Shape per_channel{1, x.shape().c, 1, 1};
  const Value gamma = scope.state("weight", per_channel, Init::constant(1));
  const Value beta = scope.state("bias", per_channel, Init::constant(0));
  return group_norm(x, gamma, beta, groups, true);
}

}  // namespace clerestory
