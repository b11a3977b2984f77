// One case as a compiled graph, run again and again with other inputs.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "checks/op_check.hpp"
#include "host/graph/plan.hpp"

namespace clerestory {

inline const char* text(Precision p) { return p == Precision::Single ? "float" : "double"; }

/// The one that computes in this precision.
const Device& device_of(const CheckedDevices& devices, Precision precision);
Tensor rounded_to_float(Tensor t);
/// Inputs and states in one map.
Tensors all_tensors(const OpCase& c);

/// A graph of the case, with its inputs as they are or as slices of bigger tensors, and its plan on a device.
class OpRun {
 public:
  struct How {
    PlanOptions options = {};
    bool wrap = false, with_gradients = false;
  };

  /// `findings` get what a kernel writes beside its outputs.
  OpRun(const OpCase& c, const CheckedDevices& devices, Precision precision, OpFindings& findings, How how);

  /// Outputs in order, gradients in theirs, then states by name.
  std::vector<Tensor> operator()();

  /// Another value of an input or state.
  void move(const std::string& name, const Tensor& tensor);

  const std::vector<Value>& outputs() const { return outputs_; }
  const std::vector<Tensor>& cotangents() const { return cotangents_; }

 private:
  Value input(const std::string& name, const Tensor& tensor);

  void feed(const std::string& name, const Tensor& tensor);

  /// A channel before and one behind each output and gradient. Made by kernels that run before those of the case, so
  /// that all three are written in place into one buffer, and what the case writes beside its output stays there to be
  /// seen.
  void add_canaries(bool with_gradients);

  void wrap_outputs();

  std::string name_of(std::size_t i) const;

  Tensor unwrapped(Tensor t, const std::string& name) const;

  void expect_canaries(std::vector<double>::const_iterator begin, long count, const std::string& where, int item) const;

  /// Appends the gradients of sum(outputs * cotangents); the cotangents are constants.
  void add_gradients(const Values& values);

  const OpCase& case_;
  Precision precision_;
  bool wrap_;
  OpFindings& findings_;
  Graph graph_;
  struct Canaries {
    Value before, behind;
  };
  std::vector<Canaries> canaries_;
  std::vector<Value> outputs_;  // and gradients behind them
  std::size_t gradients_ = 0;
  std::vector<Tensor> cotangents_;
  Tensors moved_;
  std::shared_ptr<States> states_;
  std::unique_ptr<Executor> executor_;
};

}  // namespace clerestory
