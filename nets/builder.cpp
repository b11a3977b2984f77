#include "nets/builder.hpp"

#include <cmath>

#include "host/ops/nn/batch_norm.hpp"
#include "host/ops/nn/conv.hpp"
#include "host/ops/nn/group_norm.hpp"

namespace clerestory {
namespace {

double fan_in(Value x, int kernel) { return static_cast<double>(x.shape().c) * kernel * kernel; }

}  // namespace

Value conv_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad) {
  const Value weight = scope.state("weight", {out, x.shape().c, kernel, kernel}, Init::normal(std::sqrt(2 / fan_in(x, kernel))));
  return conv(x, weight, {}, {.stride = stride, .pad = pad});
}

Value conv_bias_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad) {
  const Init init = Init::uniform(1 / std::sqrt(fan_in(x, kernel)));
  const Value weight = scope.state("weight", {out, x.shape().c, kernel, kernel}, init);
  const Value bias = scope.state("bias", {1, out, 1, 1}, init);
  return conv(x, weight, bias, {.stride = stride, .pad = pad});
}

Feature feature_of(const Scope& scope, Value value) {
  return {value, scope.training ? channel_moments(value) : Value{}};
}

Value batch_norm_layer(const Scope& scope, const Feature& x, bool relu) {
  const Shape& s = x.value.shape();
  const Shape per_channel{1, s.c, 1, 1};
  const Value gamma = scope.state("weight", per_channel, Init::constant(1));
  const Value beta = scope.state("bias", per_channel, Init::constant(0));
  const Value running_mean = scope.state("running_mean", per_channel, Init::fixed(0));
  const Value running_variance = scope.state("running_var", per_channel, Init::fixed(1));
  if (scope.training) update_running(x.moments, running_mean, running_variance, s.n * s.plane());
  const Value moments = scope.training ? x.moments : running_moments(running_mean, running_variance);
  return normalise_channels(x.value, moments, gamma, beta, relu);
}

Value group_norm_relu_layer(const Scope& scope, Value x, int groups) {
  const Shape per_channel{1, x.shape().c, 1, 1};
  const Value gamma = scope.state("weight", per_channel, Init::constant(1));
  const Value beta = scope.state("bias", per_channel, Init::constant(0));
  return group_norm(x, gamma, beta, groups, true);
}

}  // namespace clerestory
