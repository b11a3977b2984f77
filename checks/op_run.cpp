#include "checks/op_run.hpp"

#include <algorithm>

#include "host/error.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/elementwise.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr double kCanary = 12345.5;  // exact in float

Tensor padded(const Tensor& t) {
  Shape bigger = t.shape;
  bigger.c += 2;
  Tensor out(bigger, kCanary);
  for (int n = 0; n < t.shape.n; ++n)
    std::copy_n(t.real.begin() + n * t.shape.item(), t.shape.item(),
                out.real.begin() + n * bigger.item() + bigger.plane());
  return out;
}

std::vector<Shape> output_shapes(const OpCase& c) {
  Graph graph;
  Values values;
  for (const auto& [name, tensor] : c.inputs) values[name] = graph.input(name, tensor.shape, tensor.type());
  std::vector<Shape> shapes;
  for (const Value& v : c.build(graph, values)) shapes.push_back(v.shape());
  return shapes;
}

}  // namespace

const Device& device_of(const CheckedDevices& devices, Precision precision) {
  return precision == Precision::Single ? devices.single : *devices.with_doubles;
}

Tensor rounded_to_float(Tensor t) {
  for (double& x : t.real) x = static_cast<float>(x);
  return t;
}

/// Inputs and states in one map.
Tensors all_tensors(const OpCase& c) {
  Tensors all = c.inputs;
  all.insert(c.states.begin(), c.states.end());
  return all;
}

OpRun::OpRun(const OpCase& c, const CheckedDevices& devices, Precision precision, OpFindings& findings, How how)
    : case_(c), precision_(precision), wrap_(how.wrap), findings_(findings) {
  Values values;
  for (const auto& [name, tensor] : c.inputs) values[name] = input(name, tensor);
  if (wrap_) add_canaries(how.with_gradients);
  outputs_ = c.build(graph_, values);
  for (const auto& [name, tensor] : c.states) values[name] = graph_.state(name, tensor.shape, Init::fixed(0));
  if (how.with_gradients) add_gradients(values);
  if (wrap_) wrap_outputs();
  const Device device = device_of(devices, precision);
  if (!graph_.states().empty()) {
    states_ = std::make_shared<States>(device, precision);
    states_->initialise(graph_, c.seed);
  }
  how.options.precision = precision;
  executor_ = std::make_unique<Executor>(compile(graph_, outputs_, device, how.options, true), states_);
  for (const auto& [name, tensor] : c.inputs) feed(name, tensor);
}

std::vector<Tensor> OpRun::operator()() {
  for (const auto& [name, tensor] : case_.states) states_->set(name, moved_.count(name) ? moved_[name] : tensor);
  executor_->run(case_.seed);
  std::vector<Tensor> results;
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    results.push_back(unwrapped(executor_->fetch(outputs_[i]), name_of(i)));
  if (!graph_.updates().empty())
    for (const auto& [name, tensor] : case_.states) results.push_back(states_->get(name));
  return results;
}

void OpRun::move(const std::string& name, const Tensor& tensor) {
  if (case_.states.count(name))
    moved_[name] = tensor;
  else
    feed(name, tensor);
}

Value OpRun::input(const std::string& name, const Tensor& tensor) {
  if (!wrap_ || tensor.type() == Type::Int) return graph_.input(name, tensor.shape, tensor.type());
  Shape bigger = tensor.shape;
  bigger.c += 2;
  return slice(graph_.input(name, bigger), 1, tensor.shape.c);
}

void OpRun::feed(const std::string& name, const Tensor& tensor) {
  if (wrap_ && tensor.type() == Type::Real)
    executor_->feed(name, padded(tensor));
  else
    executor_->feed(name, tensor);
}

void OpRun::add_canaries(bool with_gradients) {
  std::vector<Shape> shapes = output_shapes(case_);
  if (with_gradients)
    for (const std::string& name : case_.differentiate) shapes.push_back(all_tensors(case_).at(name).shape);
  for (const Shape& s : shapes) {
    const auto canary = [&] { return affine(graph_.fill({s.n, 1, s.h, s.w}, kCanary), 1, 0); };
    canaries_.push_back({canary(), canary()});
  }
}

void OpRun::wrap_outputs() {
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (outputs_[i].type() == Type::Int) continue;
    outputs_[i] = concat(std::vector<Value>{canaries_[i].before, outputs_[i], canaries_[i].behind});
  }
}

std::string OpRun::name_of(std::size_t i) const {
  const std::size_t outputs = outputs_.size() - gradients_;
  return i < outputs ? fmt::format("output {}", i) : "the gradient of " + case_.differentiate[i - outputs];
}

Tensor OpRun::unwrapped(Tensor t, const std::string& name) const {
  if (!wrap_ || t.type() == Type::Int) return t;
  Shape s = t.shape;
  s.c -= 2;
  Tensor inner(s);
  for (int n = 0; n < s.n; ++n) {
    const auto begin = t.real.begin() + n * t.shape.item(), behind = begin + s.plane() + s.item();
    expect_canaries(begin, s.plane(), "before " + name, n);
    expect_canaries(behind, s.plane(), "behind " + name, n);
    std::copy_n(begin + s.plane(), s.item(), inner.real.begin() + n * s.item());
  }
  return inner;
}

void OpRun::expect_canaries(std::vector<double>::const_iterator begin, long count, const std::string& where,
                            int item) const {
  const auto end = begin + count, written = std::find_if(begin, end, [](double x) { return x != kCanary; });
  if (written != end)
    findings_.faults.push_back(fmt::format("{} in {}: written {}, item {}, element {}", case_.name(), text(precision_),
                                           where, item, written - begin));
}

void OpRun::add_gradients(const Values& values) {
  std::vector<Value> from, seeds, wrt;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    cotangents_.push_back(
        outputs_[i].type() == Type::Real ? rounded_to_float(random_tensor(outputs_[i].shape(), 77 + i)) : Tensor());
    if (outputs_[i].type() == Type::Int) continue;
    from.push_back(outputs_[i]), seeds.push_back(graph_.constant(cotangents_.back()));
  }
  for (const std::string& name : case_.differentiate) wrt.push_back(values.at(name));
  for (std::size_t i = 0; const Value& g : gradient(from, seeds, wrt)) {
    if (!g) throw Error(ErrorKind::Failed, "no gradient reaches " + case_.differentiate[i]);
    outputs_.push_back(g), ++gradients_, ++i;
  }
}

}  // namespace clerestory
