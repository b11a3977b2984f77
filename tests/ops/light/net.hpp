// Kernels that hold a whole net, beside the same net made of ops.
#pragma once
#include <vector>

#include "checks/op_case.hpp"
#include "tests/ops/test_device.hpp"

namespace clerestory {

/// A graph fed with tensors, for whatever is asked of it; a chunk, as inside of map_chunks.
struct Net {
  Graph graph;
  Values values;
  explicit Net(const Tensors& inputs) {
    for (const auto& [name, tensor] : inputs) values[name] = graph.input(name, tensor.shape, tensor.type());
  }
  std::vector<Tensor> run(const std::vector<Value>& outputs, const Tensors& inputs, Precision precision,
                          const Chunk& chunk = {}) {
    Executor executor(compile(graph, outputs, test_device(precision), {.precision = precision}));
    for (const auto& [name, tensor] : inputs) executor.feed(name, tensor);
    executor.run(7, chunk);
    std::vector<Tensor> results;
    for (const Value& v : outputs) results.push_back(executor.fetch(v));
    return results;
  }
};

}  // namespace clerestory
