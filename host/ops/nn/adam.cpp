#include "host/ops/nn/adam.hpp"

#include <cmath>
#include <utility>

#include "host/ops/nn/parameter_slots.hpp"
#include "host/ops/nn/square_sums.hpp"
#include "host/ops/tensor/concat.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/adam.cl";

struct ScheduleOp : NotDifferentiable {  // learning rate, step -> {1, 1, 1, 2}
  AdamOptions options;
  explicit ScheduleOp(const AdamOptions& o) : options(o) {}
  std::string name() const override { return "adam_schedule"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    for (const Value& v : in)
      if (v.shape().count() != 1)
        throw Error(ErrorKind::Failed, "rate and step are one number each", "adam", v.shape().text());
    return {{{1, 1, 1, 2}, Type::Real}};
  }
  void launch(Launch& l) const override {
    l.run_with(row_defines(l.device), kFile, "adam_schedule", Range{}, l.in(0), l.in(1), l.out(),
               Launch::Real{std::log(options.beta1)}, Launch::Real{std::log(options.beta2)});
  }
};

TensorView item_of(TensorView view, int n) {
  view.offset += static_cast<std::uint64_t>(n) * static_cast<std::uint64_t>(view.stride);
  return view;
}

struct AdamOp : NotDifferentiable {  // gradient, parameter, first moment, second moment of each; schedule
  AdamOptions options;
  int parameters;
  AdamOp(const AdamOptions& o, int p) : options(o), parameters(p) {}
  std::string name() const override { return "adam"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    for (std::size_t i = 0; i + 1 < in.size(); i += 4)
      if (!(in[i].shape() == in[i + 1].shape()))
        throw Error(ErrorKind::Failed, "the gradient has another shape", "adam", in[i].shape().text(),
                    in[i + 1].shape().text());
    return {};
  }

  /// Of each parameter all, or one item at a time where its gradient is a slice of something.
  std::vector<Slot<4>> slots(const Launch& l) const {
    std::vector<Slot<4>> slots;
    for (int i = 0; i < parameters; ++i) {
      const TensorView &g = l.in(4 * i), &p = l.in(4 * i + 1), &m = l.in(4 * i + 2), &v = l.in(4 * i + 3);
      const Shape& s = g.shape;
      const bool one_run = s.n == 1 || g.stride == s.item();  // states always are
      const int items = one_run ? 1 : s.n, count = static_cast<int>(one_run ? s.count() : s.item());
      for (int n = 0; n < items; ++n)
        slots.push_back({{item_of(g, n), item_of(p, n), item_of(m, n), item_of(v, n)}, count});
    }
    return slots;
  }

  void launch(Launch& l) const override {
    run_slots<4>(l, kFile, "adam_update", slots(l), l.inputs.back(), Launch::Real{options.beta1},
                 Launch::Real{options.beta2}, Launch::Real{1 - options.beta1}, Launch::Real{1 - options.beta2},
                 Launch::Real{options.epsilon});
  }

  std::vector<int> writes() const override {
    std::vector<int> written;
    for (int i = 0; i < parameters; ++i) written.insert(written.end(), {4 * i + 1, 4 * i + 2, 4 * i + 3});
    return written;
  }
};

}  // namespace

Value adam(std::span<const Value> parameters, std::span<const Value> gradients, Value learning_rate, Value step,
           const AdamOptions& options) {
  Graph& graph = learning_rate.graph();
  if (parameters.empty()) return {};
  const Value schedule = graph.make<ScheduleOp>({learning_rate, step}, options);
  // Summed beside the parameters, which an update waits for to be read: gradients are then needed no longer than it.
  std::vector<Value> inputs, summed, sums;
  int count = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::string& name = state_of(parameters[i]).state_name;
    if (!gradients[i])
      throw Error(ErrorKind::Failed, "a parameter has no gradient: it would stay as it is", "adam: " + name, "",
                  "a loss that depends on it, or a list of parameters without it");
    const Value m = graph.state("adam.m." + name, parameters[i].shape(), Init::fixed(0));
    const Value v = graph.state("adam.v." + name, parameters[i].shape(), Init::fixed(0));
    inputs.insert(inputs.end(), {gradients[i], parameters[i], m, v});
    summed.insert(summed.end(), {gradients[i], parameters[i]});
    if (++count < static_cast<int>(kSlots) && i + 1 < parameters.size()) continue;
    sums.push_back(square_sums(std::exchange(summed, {})));
    inputs.push_back(schedule);
    graph.make<AdamOp>(std::exchange(inputs, {}), options, std::exchange(count, 0));
  }
  return concat(sums);
}

}  // namespace clerestory
