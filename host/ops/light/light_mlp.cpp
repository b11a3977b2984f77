#include "host/ops/light/light_mlp.hpp"

#include <fmt/format.h>

#include "host/error.hpp"
#include "host/ops/light/packed_layers.hpp"

namespace clerestory {

void append_mlp(const LightMlp& mlp, std::vector<Value>& inputs, const char* op) {
  const int layers = static_cast<int>(mlp.biases.size());
  const std::size_t readers = mlp.again > 0 ? 2 : 1;
  if (layers < 1 || static_cast<int>(mlp.hidden.size()) != layers - 1 || mlp.direction.size() != readers ||
      mlp.again < 0 || mlp.again >= layers)
    throw Error(ErrorKind::Failed, "the parts of the net do not fit each other", op,
                fmt::format("{} biases, {} hidden and {} direction weights, again {}", layers, mlp.hidden.size(),
                            mlp.direction.size(), mlp.again),
                "L, L - 1, one per layer that reads the input, and again below L");
  inputs.insert(inputs.end(), {mlp.direction[0], mlp.biases[0]});
  for (int i = 1; i < layers; ++i) {
    const std::size_t at = static_cast<std::size_t>(i);
    inputs.push_back(mlp.hidden[at - 1]);
    if (i == mlp.again) inputs.push_back(mlp.direction[1]);
    inputs.push_back(mlp.biases[at]);
  }
  inputs.insert(inputs.end(), {mlp.out, mlp.out_bias});
}

std::vector<MlpPart> mlp_parts(int first_input, int layers, int again) {
  int at = first_input;
  std::vector<MlpPart> list;
  for (int layer = 0; layer <= layers; ++layer) {
    const bool reads = again > 0 && layer == again;
    if (reads) {  // W_i, D_i, b_i
      list.push_back({layer, true, at + 1, at + 2}), list.push_back({layer, false, at, -1});
      at += 3;
    } else {
      list.push_back({layer, layer == 0, at, at + 1});
      at += 2;
    }
  }
  return list;
}

void check_mlp(std::span<const Value> inputs, const std::vector<MlpPart>& parts, int features, int width,
               const char* op) {
  for (const MlpPart& part : parts)
    check_layer(inputs[static_cast<std::size_t>(part.weight)],
                part.bias < 0 ? Value{} : inputs[static_cast<std::size_t>(part.bias)],
                part.of_encoded ? features : width, part.layer == parts.back().layer ? 3 : width, op);
}

}  // namespace clerestory
