// What every network is built with: the graph, whether it trains, and names of states that follow PyTorch's.
#pragma once
#include <string>

#include "host/graph/graph.hpp"

namespace clerestory {

/// A place in the tree of names: `Scope{g, training, "encoder"} / "conv0"` names "encoder.conv0".
struct Scope {
  Graph& graph;
  bool training = false;  // batch statistics and their updates, instead of running statistics
  std::string name;
  bool frozen = false;  // no state below is trained: a net that others are only looked at through

  Scope operator/(const std::string& child) const {
    return {graph, training, name.empty() ? child : name + "." + child, frozen};
  }
  Value state(const std::string& child, const Shape& shape, Init init) const {
    init.trainable = init.trainable && !frozen;
    return graph.state((*this / child).name, shape, init);
  }
};

/// The graph's parameters but those of `frozen` scopes ("decoder_depth", "local.encoder"): what a training moves.
std::vector<Value> trained_parameters(const Graph& graph, const std::vector<std::string>& frozen);

/// Convolution with its states: weight {out, in, k, k} ~ normal of deviation sqrt(2 / fan_in) (He et al. 2015), no
/// bias.
Value conv_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad);
/// The same with bias; weight and bias uniform in +-1/sqrt(fan_in), PyTorch's default.
Value conv_bias_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad);
/// The same with weights ~ normal of deviation sqrt(2 / fan_in) and a bias of 0: what folded normalisations leave.
Value conv_shift_layer(const Scope& scope, Value x, int out, int kernel, int stride, int pad);
/// Depthwise convolution with its states: weight {channels, 1, k, k} ~ normal of deviation sqrt(2) / k, bias 0.
Value depthwise_layer(const Scope& scope, Value x, int kernel, int stride);

/// A feature and its moments over batch and plane, computed once and shared by all layers that normalise it. Moments
/// are empty in inference.
struct Feature {
  Value value, moments;
};
Feature feature_of(const Scope& scope, Value value);
/// Batch normalisation (states weight, bias, running_mean, running_var), then ReLU if `relu`.
Value batch_norm_layer(const Scope& scope, const Feature& x, bool relu);
/// Batch normalisation of x (states of `norm`), ReLU, convolution (state of `scope`) without bias: DenseNet's order.
/// The convolution normalises what it reads, so that the normalised tensor exists in no memory.
Value norm_conv_layer(const Scope& norm, const Scope& scope, const Feature& x, int out, int kernel, int stride,
                      int pad);
/// Group normalisation (states weight, bias), then ReLU.
Value group_norm_relu_layer(const Scope& scope, Value x, int groups);

}  // namespace clerestory
