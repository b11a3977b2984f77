#include "host/ops/nn/adam.hpp"

#include <cmath>

#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr auto kFile = "nn/adam.cl";

struct ScheduleOp : Op {  // learning rate, step -> {1, 1, 1, 2}
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

struct AdamOp : Op {  // gradient, parameter, first moment, second moment, schedule
  AdamOptions options;
  explicit AdamOp(const AdamOptions& o) : options(o) {}
  std::string name() const override { return "adam"; }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    if (!(in[0].shape() == in[1].shape()))
      throw Error(ErrorKind::Failed, "the gradient has another shape", "adam", in[0].shape().text(),
                  in[1].shape().text());
    return {};
  }

  void launch(Launch& l) const override {
    Shape s = l.in(0).shape;
    const bool one_run = l.in(0).stride == s.item();  // states always are
    if (one_run) s = {1, 1, 1, static_cast<int>(s.count())};
    const int item = static_cast<int>(s.item());
    const Blocks blocks = row_blocks(l.device, item);
    l.run_with(row_defines(l.device), kFile, "adam_update", row_range(l.device, blocks.count, s.n), l.in(0), l.in(1),
               l.in(2), l.in(3), l.in(4), Launch::Real{options.beta1}, Launch::Real{options.beta2},
               Launch::Real{options.epsilon}, item, blocks.length);
  }

  std::vector<int> writes() const override { return {1, 2, 3}; }
};

}  // namespace

void adam(std::span<const Value> parameters, std::span<const Value> gradients, Value learning_rate, Value step,
          const AdamOptions& options) {
  Graph& graph = learning_rate.graph();
  const Value schedule = graph.make<ScheduleOp>({learning_rate, step}, options);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!gradients[i]) continue;
    const std::string& name = static_cast<const StateOp&>(*parameters[i].node->op).state_name;
    const Value m = graph.state("adam.m." + name, parameters[i].shape(), Init::fixed(0));
    const Value v = graph.state("adam.v." + name, parameters[i].shape(), Init::fixed(0));
    graph.make<AdamOp>({gradients[i], parameters[i], m, v, schedule}, options);
  }
}

}  // namespace clerestory
