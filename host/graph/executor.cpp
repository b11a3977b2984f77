#include <algorithm>

#include "host/cl/seconds_of.hpp"
#include "host/graph/plan.hpp"
#include "host/graph/transfer.hpp"
#include "host/process_memory.hpp"

namespace clerestory {
namespace {

/// The seed of a node's own draws: 32 bits of (seed, key) by SplitMix64's finaliser.
std::uint32_t seed_of(const Node& node, std::uint32_t seed) {
  if (node.draws == 0) return seed;
  std::uint64_t z = (static_cast<std::uint64_t>(node.draws) << 32 | seed) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<std::uint32_t>((z ^ (z >> 31)) >> 32);
}

const std::string& name_of(const Node& input) { return static_cast<const InputOp&>(*input.op).input_name; }

}  // namespace

Executor::Executor(Plan plan, std::shared_ptr<States> states) : plan_(std::move(plan)), states_(std::move(states)) {
  Device& device = plan_.device;
  const Precision precision = plan_.options.precision;
  if (!plan_.state_nodes.empty() && !states_)
    throw Error(ErrorKind::Failed, "the plan has states, the executor was given none", "executor");
  if (states_ && states_->precision() != precision)
    throw Error(ErrorKind::Failed, "plan and states differ in precision", "executor");
  for (const Node* node : plan_.state_nodes)
    if (const StateOp& state = state_of(node->value()); states_->has(state.state_name)) states_->check_shape(state);
  if (plan_.arena_bytes > device.info().max_allocation)
    throw Error(ErrorKind::Device, "the plan needs more memory in one piece than the device gives", device.info().name,
                fmt::format("{} MiB", plan_.arena_bytes >> 20),
                fmt::format("at most {} MiB", device.info().max_allocation >> 20));
  resident_before_ = process_memory().now;
  if (plan_.arena_bytes > 0) arena_ = device.allocate(plan_.arena_bytes);
  const auto own = [&](const Signature& s) {
    const std::size_t element = s.type == Type::Int ? 4 : real_size(precision);
    return TensorView{device.allocate(static_cast<std::size_t>(s.shape.count()) * element), 0,
                      static_cast<int>(s.shape.item()), s.shape, s.type};
  };
  owns_.resize(plan_.input_nodes.size());
  inputs_.resize(plan_.input_nodes.size());  // allocated when first fed: many are bound to memory of others
  for (const Node* node : plan_.constant_nodes) {
    constants_.push_back(own(node->outputs[0]));
    upload(device, constants_.back(), static_cast<const ConstantOp&>(*node->op).tensor, precision);
  }
  for (const Step& step : plan_.steps)
    bodies_.push_back(step.body ? std::make_unique<Executor>(*step.body, states_) : nullptr);
}

void Executor::allocate_input(std::size_t index) {
  const Signature& s = plan_.input_nodes[index]->outputs[0];
  const std::size_t element = s.type == Type::Int ? 4 : real_size(plan_.options.precision);
  const std::size_t bytes = static_cast<std::size_t>(s.shape.count()) * element;
  inputs_[index] = {plan_.device.allocate(bytes), 0, static_cast<int>(s.shape.item()), s.shape, s.type};
  fed_bytes_ += bytes, owns_[index] = true;
}

void Executor::feed(const std::string& input, const Tensor& tensor) {
  for (std::size_t i = 0; i < plan_.input_nodes.size(); ++i) {
    if (name_of(*plan_.input_nodes[i]) != input) continue;
    const Signature& s = plan_.input_nodes[i]->outputs[0];
    if (!(tensor.shape == s.shape))
      throw Error(ErrorKind::Failed, "an input has another shape", input, tensor.shape.text(), s.shape.text());
    if (!owns_[i]) allocate_input(i);  // never into what it was bound to
    upload(plan_.device, inputs_[i], tensor, plan_.options.precision);
    return;
  }
  // An input that no output needs was pruned; only a name the graph does not know is a mistake.
  for (const Node& node : plan_.graph->nodes())
    if (dynamic_cast<const InputOp*>(node.op.get()) && name_of(node) == input) return;
  throw Error(ErrorKind::Failed, "the graph has no such input", input);
}

void Executor::feed(const std::string& input, std::span<const float> data) {
  for (const Node* node : plan_.input_nodes)
    if (name_of(*node) == input)
      return feed(input, Tensor(node->outputs[0].shape, std::vector<double>(data.begin(), data.end())));
  feed(input, Tensor());
}

void Executor::bind(const std::string& input, const TensorView& memory) {
  for (std::size_t i = 0; i < plan_.input_nodes.size(); ++i) {
    if (name_of(*plan_.input_nodes[i]) != input) continue;
    const Signature& s = plan_.input_nodes[i]->outputs[0];
    if (!(memory.shape == s.shape) || memory.type != s.type)
      throw Error(ErrorKind::Failed, "an input has another shape", input, memory.shape.text(), s.shape.text());
    if (owns_[i]) fed_bytes_ -= inputs_[i].buffer.bytes();
    inputs_[i] = memory, owns_[i] = false;
  }
}

TensorView Executor::resolve(const Placement& place, const Shape& shape, Type type) const {
  TensorView view;
  const std::size_t element = type == Type::Int ? 4 : real_size(plan_.options.precision);
  switch (place.where) {
    case Placement::Where::Arena:
      return {arena_, plan_.roots[static_cast<std::size_t>(place.slot)] / element + place.offset, place.stride, shape,
              type};
    case Placement::Where::Input: {
      view = inputs_[static_cast<std::size_t>(place.slot)];
      const Node& node = *plan_.input_nodes[static_cast<std::size_t>(place.slot)];
      if (!view.buffer) throw Error(ErrorKind::Failed, "an input was not fed", name_of(node));
      // A bound tensor may be strided; a value that is a view of it was placed as if it were contiguous.
      const Shape& whole = node.outputs[0].shape;
      if (whole.n > 1 && view.stride != whole.item() && place.stride != whole.item())
        throw Error(ErrorKind::Failed, "a view regroups a strided input", name_of(node));
      if (place.stride == whole.item()) return {view.buffer, view.offset + place.offset, view.stride, shape, type};
      return {view.buffer, view.offset + place.offset, place.stride, shape, type};
    }
    case Placement::Where::State:
      view = states_->view(state_of(plan_.state_nodes[static_cast<std::size_t>(place.slot)]->value()).state_name);
      break;
    case Placement::Where::Constant:
      view = constants_[static_cast<std::size_t>(place.slot)];
      break;
  }
  return {view.buffer, view.offset + place.offset, place.stride, shape, type};
}

void Executor::run(std::uint32_t seed, const Chunk& chunk) {
  Launch launch(plan_.device, plan_.options.precision, plan_.options.gemm);
  launch.chunk = chunk, launch.small_nets_whole = plan_.options.small_nets_whole;
  if (after_chunk_) launch.after_chunk = &after_chunk_;
  for (std::size_t at = 0; at < plan_.steps.size(); ++at) {
    const Step& step = plan_.steps[at];
    const Node& node = *step.node;
    launch.seed = seed_of(node, seed);
    launch.inputs.clear(), launch.outputs.clear();
    for (std::size_t i = 0; i < step.inputs.size(); ++i)
      launch.inputs.push_back(resolve(step.inputs[i], node.inputs[i].shape(), node.inputs[i].type()));
    for (std::size_t o = 0; o < step.outputs.size(); ++o)
      launch.outputs.push_back(resolve(step.outputs[o], node.outputs[o].shape, node.outputs[o].type));
    launch.workspace = {};
    if (const std::size_t elements = node.op->workspace(node))
      launch.workspace =
          resolve(step.workspace, {1, 1, 1, static_cast<int>(std::min<std::size_t>(elements, 0x7fffffff))}, Type::Real);

    // A view that memory allowed needs no work.
    if (node.op->view_offset(node) >= 0 && launch.out().buffer.handle() == launch.in(0).buffer.handle() &&
        launch.out().offset == launch.in(0).offset + static_cast<std::uint64_t>(node.op->view_offset(node)))
      continue;
    launch.body = bodies_[at].get();
    if (seconds_.empty()) {
      node.op->launch(launch);
      continue;
    }
    const double before = launch.body ? launch.body->profiled_seconds() : 0;
    const double all = seconds_of(plan_.device, [&] { node.op->launch(launch); });
    seconds_[at] += all - (launch.body ? launch.body->profiled_seconds() - before : 0);
  }
}

void Executor::set_profiling(bool on) {
  seconds_.assign(on ? plan_.steps.size() : 0, 0.0);
  for (const auto& body : bodies_)
    if (body) body->set_profiling(on);
}

double Executor::profiled_seconds() const {
  double seconds = 0;
  for (const double s : seconds_) seconds += s;
  for (const auto& body : bodies_)
    if (body) seconds += body->profiled_seconds();
  return seconds;
}

TensorView Executor::view(Value output) const {
  for (std::size_t i = 0; i < plan_.outputs.size(); ++i)
    if (plan_.outputs[i] == output) return resolve(plan_.output_places[i], output.shape(), output.type());
  throw Error(ErrorKind::Failed, "this value is not an output of the plan", "fetch");
}

Tensor Executor::fetch(Value output) { return download(plan_.device, view(output), plan_.options.precision); }

std::vector<float> Executor::fetch_floats(Value output) { return fetch(output).floats(); }

std::size_t Executor::bytes() const {
  std::size_t bytes = plan_.arena_bytes + fed_bytes_;
  for (const TensorView& v : constants_) bytes += v.buffer.bytes();
  for (const auto& body : bodies_)
    if (body) bytes += body->bytes();
  return bytes;
}

std::size_t Executor::predicted_process() const {
  const PlanMemory m = plan_.memory();
  return resident_before_ == 0 || !plan_.device.info().cpu ? 0 : resident_before_ + m.total() - m.states;
}

void Executor::add_work(std::map<std::string, Work>& rows, int times) const {
  for (std::size_t i = 0; i < plan_.steps.size(); ++i) {
    const Node& node = *plan_.steps[i].node;
    const Cost cost = node.op->cost(node);
    Work& row = rows[node.op->name()];
    row.steps += times, row.cost.flops += times * cost.flops, row.cost.bytes += times * cost.bytes;
    if (!seconds_.empty()) row.seconds += seconds_[i];
    if (bodies_[i]) bodies_[i]->add_work(rows, times * plan_.steps[i].times);
  }
}

std::map<std::string, Work> Executor::work(bool profile) {
  const struct Off {  // whatever comes
    Executor& executor;
    ~Off() { executor.set_profiling(false); }
  } off{*this};
  set_profiling(profile);
  if (profile) run();
  std::map<std::string, Work> rows;
  add_work(rows, 1);
  return rows;
}

std::string Executor::explain(bool profile) {
  const std::map<std::string, Work> rows = work(profile);
  Work total;
  for (const auto& [name, row] : rows) {
    total.steps += row.steps, total.seconds += row.seconds;
    total.cost.flops += row.cost.flops, total.cost.bytes += row.cost.bytes;
  }
  std::vector<std::pair<std::string, Work>> sorted(rows.begin(), rows.end());
  std::stable_sort(sorted.begin(), sorted.end(), [&](const auto& a, const auto& b) {
    return profile ? a.second.seconds > b.second.seconds : a.second.cost.flops > b.second.cost.flops;
  });
  sorted.emplace_back("total", total);
  std::string text = fmt::format("{:24} {:>6} {:>10} {:>10} {:>10} {:>9} {:>8}\n", "op", "steps", "GFLOP", "MB", "ms",
                                 "GFLOP/s", "GB/s");
  for (const auto& [name, row] : sorted) {
    text +=
        fmt::format("{:24} {:>6} {:>10.3f} {:>10.2f}", name, row.steps, row.cost.flops * 1e-9, row.cost.bytes * 1e-6);
    if (profile && row.seconds > 0)
      text += fmt::format(" {:>10.3f} {:>9.1f} {:>8.1f}", row.seconds * 1e3, row.cost.flops * 1e-9 / row.seconds,
                          row.cost.bytes * 1e-9 / row.seconds);
    text += '\n';
  }
  for (const std::string& note : plan_.notes) text += note + '\n';
  return text + explain_memory();
}

std::string Executor::explain_memory() const {
  const auto mib = [](std::size_t bytes) { return static_cast<double>(bytes) / 0x1p20; };
  const PlanMemory m = plan_.memory();
  std::string text = fmt::format("{:24} {:>10}\n", "memory", "MiB");
  const auto row = [&](const char* name, std::size_t bytes, const std::string& remark = {}) {
    text += fmt::format("{:24} {:>10.1f}{}{}\n", name, mib(bytes), remark.empty() ? "" : "   ", remark);
  };
  row("values", m.values, fmt::format("at most {:.1f} alive at once, in {}", mib(m.alive), m.fullest));
  row("bodies", m.bodies, "their arenas and constants");
  row("constants", m.constants);
  row("inputs", m.inputs);
  row("states", m.states);
  row("this plan", m.total(), "predicted");
  row("the device", plan_.device.memory_now(),
      fmt::format("held now, at most {:.1f}", mib(plan_.device.memory_peak())));
  if (const std::size_t predicted = predicted_process(); predicted > 0)
    row("the process", predicted,
        fmt::format("predicted before the first run; resident so far at most {:.1f}", mib(process_memory().peak)));
  return text;
}

std::vector<Tensor> evaluate(const Graph& graph, std::vector<Value> outputs, Device device,
                             const std::map<std::string, Tensor>& feeds, const PlanOptions& options, std::uint32_t seed,
                             std::shared_ptr<States> states) {
  Executor executor(compile(graph, outputs, std::move(device), options), std::move(states));
  for (const auto& [name, tensor] : feeds) executor.feed(name, tensor);
  executor.run(seed);
  std::vector<Tensor> values;
  for (const Value& v : outputs) values.push_back(executor.fetch(v));
  return values;
}

}  // namespace clerestory
