// compile(): prune, order, decide where every value lives, let go what a budget does not allow, and pack the rest into
// one arena.
#include <algorithm>
#include <cmath>
#include <map>

#include "host/graph/keep.hpp"
#include "host/graph/layout.hpp"
#include "host/graph/plan.hpp"
#include "host/graph/recompute.hpp"
#include "host/tuning/tuning.hpp"

namespace clerestory {
namespace {

constexpr double kMiB = 0x1p20;

double mib(std::size_t bytes) { return static_cast<double>(bytes) / kMiB; }

Cost cost_of(const Schedule& s) {
  Cost sum;
  for (const int t : s.order) {
    const Node& node = *s.tasks[static_cast<std::size_t>(t)].node;
    const Cost cost = node.op->cost(node);
    sum.flops += cost.flops, sum.bytes += cost.bytes;
  }
  return sum;
}

void choose_gemm(PlanOptions& options, const Device& device) {
  if (options.gemm == "auto") options.gemm = device.gemm();
  if (options.gemm == "auto") options.gemm = preferred_gemm(device), options.small_nets_whole = true;
}

class Compiler {
 public:
  Compiler(const Graph& graph, std::vector<Value> outputs, Device device, const PlanOptions& options, bool updates,
           std::span<const Value> given = {})
      : graph_(graph) {
    plan_.graph = &graph, plan_.device = std::move(device), plan_.options = options, plan_.outputs = std::move(outputs);
    choose_gemm(plan_.options, plan_.device);
    schedule_ = schedule_as_made(graph_, plan_.outputs, plan_.options.prune, updates, inputs_for(given));
    if (plan_.options.budget == 0 && plan_.options.keep > 0)
      for (const std::string& line : keep_for_replays(schedule_, plan_.options, *plan_.made)) note("{}", line);
    list_leaves();
    compile_bodies();
    note("prune: {} of {} nodes run", schedule_.order.size() + schedule_.leaves.size(), graph_.nodes().size());
    for (const std::string& line : graph_.what_was_left_out()) note("left out: {}", line);
    layout_ = lay_out(schedule_, plan_.options);
    if (plan_.options.reorder) reorder();
    pack_values();
    if (plan_.options.budget > 0) keep_to_budget();
    emit();
  }

  Plan take() { return std::move(plan_); }

 private:
  template <class... Args>
  void note(fmt::format_string<Args...> text, Args&&... args) {
    plan_.notes.push_back(fmt::format(text, std::forward<Args>(args)...));
  }

  std::vector<Given> inputs_for(std::span<const Value> values) {
    std::vector<Given> given;
    for (const Value& v : values) {
      Node& node = plan_.made->emplace_back();
      node.id = static_cast<int>(graph_.nodes().size() + given.size()), node.graph = &v.graph();
      node.outputs = {{v.shape(), v.type()}};
      node.op = std::make_unique<const InputOp>(Body::given_name(given.size()), node.outputs[0]);
      given.push_back({v, &node});
    }
    return given;
  }

  void list_leaves() {
    for (const Node* leaf : schedule_.leaves) {
      if (dynamic_cast<const InputOp*>(leaf->op.get()))
        plan_.input_nodes.push_back(leaf);
      else if (dynamic_cast<const StateOp*>(leaf->op.get()))
        plan_.state_nodes.push_back(leaf);
      else
        plan_.constant_nodes.push_back(leaf);
    }
  }

  /// Bodies keep to no budget of their own, and nothing.
  void compile_bodies() {
    PlanOptions options = plan_.options;
    options.budget = 0, options.keep = 0;
    for (const int t : schedule_.order) {
      const Node& node = *schedule_.tasks[static_cast<std::size_t>(t)].node;
      if (const Body body = node.op->body(); body.graph)
        bodies_[t] = std::make_shared<const Plan>(
            Compiler(*body.graph, body.outputs, plan_.device, options, false, body.given).take());
    }
  }

  std::size_t most_alive(const Schedule& s, const Layout& layout) const {
    const std::vector<std::size_t> alive = layout.alive(s.order.size());
    return alive.empty() ? 0 : *std::ranges::max_element(alive);
  }

  void reorder() {
    const std::size_t as_made = most_alive(schedule_, layout_);
    std::size_t least = as_made;
    const char* chosen = "as made";
    const auto try_order = [&](const char* name, Schedule s) {
      Layout layout = lay_out(s, plan_.options);
      const std::size_t most = most_alive(s, layout);
      if (most >= least) return;
      least = most, chosen = name;
      schedule_ = std::move(s), layout_ = std::move(layout);
    };
    const Schedule made = schedule_, last_first = last_made_first(made);
    const Precision precision = plan_.options.precision;
    try_order("as made, what is large when it is read", when_read(made, precision));
    try_order("what was made last first", last_first);
    try_order("what was made last first, what is large when it is read", when_read(last_first, precision));
    note("order: {}; at most {:.1f} MiB alive, {:.1f} as made", chosen, mib(least), mib(as_made));
  }

  void pack_values() {
    const std::vector<std::size_t> alive = layout_.alive(schedule_.order.size());
    plan_.alive_bytes = 0, plan_.fullest.clear();
    if (const auto most = std::ranges::max_element(alive); most != alive.end()) {
      const int task = schedule_.order[static_cast<std::size_t>(most - alive.begin())];
      plan_.alive_bytes = *most, plan_.fullest = schedule_.tasks[static_cast<std::size_t>(task)].node->op->name();
    }
    Packing packing = pack(layout_.roots, plan_.options.reuse);
    plan_.roots = std::move(packing.offsets), plan_.arena_bytes = packing.bytes;
  }

  void keep_to_budget() {
    const std::size_t beside = memory_with_bodies() - plan_.arena_bytes, budget = plan_.options.budget;
    const Cost before = cost_of(schedule_);
    const std::size_t kept = plan_.arena_bytes, steps = schedule_.order.size();
    if (kept + beside > budget) {
      const Schedule whole = schedule_;
      if (!fit(budget - std::min(budget, beside))) {
        schedule_ = whole, layout_ = lay_out(schedule_, plan_.options);
        recompute(schedule_, layout_, plan_.options, 0);  // all that helps
        pack_values();
        if (plan_.arena_bytes + beside > budget) refuse(plan_.arena_bytes + beside);
      }
    }
    const Cost after = cost_of(schedule_);
    note(
        "recompute: {} steps more, {:.1f} MiB of values less; {:+.1f} GFLOP and {:+.1f} MB moved, {:.1f} % and {:.1f} "
        "%",
        schedule_.order.size() - steps, mib(kept - plan_.arena_bytes), (after.flops - before.flops) * 1e-9,
        (after.bytes - before.bytes) * 1e-6, 100 * (after.flops / std::max(before.flops, 1.0) - 1),
        100 * (after.bytes / std::max(before.bytes, 1.0) - 1));
  }

  /// No more than the arena's `bytes` need: packed, values take a little more than is alive at once, so that less may
  /// be. False when that has not led there.
  bool fit(std::size_t bytes) {
    constexpr int kTries = 8;
    std::size_t goal = bytes;
    for (int i = 0; i < kTries; ++i) {
      recompute(schedule_, layout_, plan_.options, goal);
      pack_values();
      if (plan_.arena_bytes <= bytes) return true;
      if (plan_.alive_bytes > goal) return false;
      goal -= std::min(goal, std::max(plan_.arena_bytes - bytes, goal / 64));
    }
    return false;
  }

  std::size_t memory_with_bodies() const {
    std::size_t bytes = plan_.memory().total();  // of a plan without steps: no bodies
    for (const auto& [task, body] : bodies_) bytes += body->memory_as_body();
    return bytes;
  }

  [[noreturn]] void refuse(std::size_t least) const {
    throw usage_error("the plan does not fit, whatever is computed again", plan_.options.budget_name,
                      fmt::format("{:.1f} MiB", mib(plan_.options.budget)),
                      fmt::format("at least {:.1f} MiB", std::ceil(10 * mib(least)) / 10));
  }

  void emit() {
    note("alias: {} values written in place into concatenations", layout_.gathered);
    note("alias: {} views, {} values computed in place", layout_.views, layout_.in_place);
    for (const int t : schedule_.order) {
      const Task& task = schedule_.tasks[static_cast<std::size_t>(t)];
      Step step;
      step.node = task.node;
      for (const TaskValue& v : task.inputs) step.inputs.push_back(layout_.place(v));
      step.outputs = layout_.places[static_cast<std::size_t>(t)];
      step.workspace = layout_.workspaces[static_cast<std::size_t>(t)];
      if (const auto body = bodies_.find(t); body != bodies_.end()) {
        step.body = body->second, step.times = task.node->op->body().times;
        note("{}: {} runs of a body", task.node->op->name(), step.times);
        for (const std::string& line : step.body->notes) note("  {}", line);
      }
      plan_.steps.push_back(std::move(step));
    }
    for (const TaskValue& v : schedule_.outputs) plan_.output_places.push_back(layout_.place(v));
    std::size_t values = 0;
    for (const Root& root : layout_.roots) values += root.bytes;
    note("arena: {:.1f} MiB for {:.1f} MiB of values, at most {:.1f} MiB of them alive", mib(plan_.arena_bytes),
         mib(values), mib(plan_.alive_bytes));
  }

  const Graph& graph_;
  Plan plan_;
  Schedule schedule_;
  Layout layout_;
  std::map<int, std::shared_ptr<const Plan>> bodies_;  // by task
};

}  // namespace

std::size_t Plan::memory_as_body() const {
  const PlanMemory m = memory();
  return m.values + m.bodies + m.constants;  // inputs are bound, states are the outer plan's
}

PlanMemory Plan::memory() const {
  const auto sum = [&](const std::vector<const Node*>& leaves) {
    std::size_t bytes = 0;
    for (const Node* leaf : leaves)
      bytes += static_cast<std::size_t>(leaf->outputs[0].shape.count()) *
               (leaf->outputs[0].type == Type::Int ? 4 : real_size(options.precision));
    return bytes;
  };
  PlanMemory m;
  m.values = arena_bytes, m.alive = alive_bytes, m.fullest = fullest;
  m.constants = sum(constant_nodes), m.inputs = sum(input_nodes), m.states = sum(state_nodes);
  for (const Step& step : steps)
    if (step.body) m.bodies += step.body->memory_as_body();
  return m;
}

Plan compile(const Graph& graph, std::vector<Value> outputs, Device device, const PlanOptions& options, bool updates) {
  return Compiler(graph, std::move(outputs), std::move(device), options, updates).take();
}

}  // namespace clerestory
