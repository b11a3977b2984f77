// The weights of the in-view light's MLP, as the ops take them that run it whole: ask_mlp and ray_mlp.
#pragma once
#include <vector>

#include "host/graph/graph.hpp"

namespace clerestory {

inline constexpr int kMostMlpWidth = 512;

/// L hidden layers, each followed by relu, and an output layer.
struct LightMlp {
  std::vector<Value> hidden;     // {width, width, 1, 1} of the layers 1 ... L - 1
  std::vector<Value> direction;  // {width, E, 1, 1}, of what is encoded, of layer 0 and, with `again`, of that layer
  std::vector<Value> biases;     // {1, width, 1, 1} of the layers 0 ... L - 1
  Value out, out_bias;           // {3, width, 1, 1}, {1, 3, 1, 1}
  int again = 0;                 // the layer that reads the input once more; 0: none
};

/// A product of a layer, by the inputs of an op whose weights begin at some input.
struct MlpPart {
  int layer = 0;              // the output layer: L
  bool of_encoded = false;    // it multiplies what is encoded, not what the layer before gives
  int weight = 0, bias = -1;  // -1: none
};

/// The weights as inputs of an op, appended to `inputs`: D_0, b_0; of each further layer W_i, b_i, and D_i in between
/// when it is `again`; W, b. Throws Error when there are more or fewer of one kind than layers have.
void append_mlp(const LightMlp& mlp, std::vector<Value>& inputs, const char* op);

/// The products in the order in which kernels take them: that of e before that of the layer before, which then has no
/// bias.
std::vector<MlpPart> mlp_parts(int first_input, int layers, int again);

/// Throws Error unless the op's inputs have the shapes of such a net.
void check_mlp(std::span<const Value> inputs, const std::vector<MlpPart>& parts, int features, int width,
               const char* op);

}  // namespace clerestory
