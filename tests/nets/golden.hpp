// Golden values of whole networks, made by experiments/peers/golden_nets.py with PyTorch in double precision. Weights
// and inputs follow a formula that both sides compute.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "host/graph/plan.hpp"
#include "host/io/safetensors.hpp"

namespace clerestory {

/// Numbers in [-0.5, 0.5), exact in float: 24 bits of a hash of (name, index).
Tensor formula(const std::string& name, const Shape& shape);
/// A state's value by the formula: He-scaled convolutions, norms about 1, biases about 0, moments 0, running statistics
/// 0 and 1.
Tensor golden_weight(const std::string& name, const Shape& shape);

/// A training batch's picture, true maps and masks by the formula, by input name.
std::map<std::string, Tensor> golden_maps(int batch, int height, int width);

/// The default device, or another one when it has no doubles and they are asked for.
Device device_for(Precision precision);

/// Adds the gradients of `outputs`, weighted by `seeds`, to `results`: of each of `wrt`, a state or an input, under
/// prefix and its name. Throws Error when one has none.
void add_gradients(std::map<std::string, Value>& results, const std::string& prefix, std::span<const Value> outputs,
                   std::span<const Value> seeds, std::span<const Value> wrt);

/// A network of golden weights on the test device, and its results beside the stored ones.
class GoldenNet {
 public:
  /// `file` lies in tests/data/nets.
  GoldenNet(const std::string& file, Precision precision);

  Graph graph;
  Device device;
  Precision precision;

  void fill_states();  // with golden weights
  /// Compiles with updates and runs once.
  void run(const std::map<std::string, Value>& results, const std::map<std::string, Tensor>& feeds, bool updates);

  /// |value - golden| <= tolerance * (largest golden of the tensor) for each stored element.
  void expect_elements(const std::string& result, const std::string& golden, double tolerance);
  /// |value - golden| <= tolerance * |golden| in the Euclidean norm.
  void expect_norm(const std::string& result, const std::string& golden, double tolerance);
  void expect_state(const std::string& state, const std::string& golden, double tolerance);

  const Tensor& result(const std::string& name) const { return results_.at(name); }
  const TensorFile& golden() const { return file_; }

 private:
  /// The elements that were stored of a tensor: all, or so many spread evenly.
  std::vector<double> stored_elements(const Tensor& t, std::size_t count) const;
  void expect_close(const Tensor& t, const std::string& golden, double tolerance);

  TensorFile file_;
  std::shared_ptr<States> states_;
  std::map<std::string, Tensor> results_;
};

}  // namespace clerestory
