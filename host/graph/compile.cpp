// compile(): prune, schedule, decide where every value lives, and pack those places into one arena.
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "host/graph/plan.hpp"

namespace clerestory {
namespace {

constexpr int kForever = std::numeric_limits<int>::max();
constexpr std::size_t kAlignment = 256;  // bytes: beyond any device's need, and a multiple of every vector

using Key = std::pair<int, int>;  // node id, output
Key key(const Value& v) { return {v.node->id, v.output}; }

/// A piece of memory and the steps between which somebody needs it.
struct Root {
  std::size_t bytes = 0;
  int first = kForever, last = -1;
  std::vector<Key> members;
};

class Compiler {
 public:
  Compiler(const Graph& graph, std::vector<Value> outputs, Device device, const PlanOptions& options, bool updates)
      : graph_(graph), plan_{} {
    plan_.graph = &graph, plan_.device = std::move(device), plan_.options = options, plan_.outputs = std::move(outputs);
    if (plan_.options.gemm == "auto") plan_.options.gemm = plan_.device.gemm();
    schedule(updates);
    place_leaves();
    find_last_uses();
    if (plan_.options.alias) place_gathered();
    place_rest();
    pack();
    emit();
  }

  Plan take() { return std::move(plan_); }

 private:
  void schedule(bool updates) {
    const std::size_t count = graph_.nodes().size();
    std::vector<bool> needed(count, !plan_.options.prune);
    for (const Value& v : plan_.outputs) needed[static_cast<std::size_t>(v.node->id)] = true;
    for (const Node& node : graph_.nodes())
      if (!node.op->writes().empty()) needed[static_cast<std::size_t>(node.id)] = updates;
    for (std::size_t id = count; id-- > 0;)
      if (needed[id])
        for (const Value& v : graph_.nodes()[id].inputs) needed[static_cast<std::size_t>(v.node->id)] = true;

    for (const bool update : {false, true})
      for (const Node& node : graph_.nodes())
        if (needed[static_cast<std::size_t>(node.id)] && node.op->writes().empty() != update) order_.push_back(&node);
    plan_.notes.push_back(fmt::format("prune: {} of {} nodes run", order_.size(), count));
    for (const std::string& line : graph_.what_was_left_out()) plan_.notes.push_back("left out: " + line);
  }

  void place_leaves() {
    std::vector<const Node*> steps;
    for (const Node* node : order_) {
      if (dynamic_cast<const InputOp*>(node->op.get()))
        add_leaf(*node, Placement::Where::Input, plan_.input_nodes);
      else if (dynamic_cast<const StateOp*>(node->op.get()))
        add_leaf(*node, Placement::Where::State, plan_.state_nodes);
      else if (dynamic_cast<const ConstantOp*>(node->op.get()))
        add_leaf(*node, Placement::Where::Constant, plan_.constant_nodes);
      else
        steps.push_back(node);
    }
    order_ = std::move(steps);
    for (std::size_t i = 0; i < order_.size(); ++i) position_[order_[i]->id] = static_cast<int>(i);
  }

  void add_leaf(const Node& node, Placement::Where where, std::vector<const Node*>& list) {
    places_[{node.id, 0}] = {where, static_cast<int>(list.size()), 0, static_cast<int>(node.outputs[0].shape.item())};
    list.push_back(&node);
  }

  void find_last_uses() {
    for (const Node* node : order_) {
      for (int o = 0; o < static_cast<int>(node->outputs.size()); ++o) last_use_[{node->id, o}] = position_[node->id];
      for (const Value& v : node->inputs) last_use_[key(v)] = position_[node->id];
    }
    for (const Value& v : plan_.outputs) last_use_[key(v)] = kForever;
  }

  std::size_t bytes_of(const Signature& s) const {
    return static_cast<std::size_t>(s.shape.count()) * (s.type == Type::Int ? 4 : real_size(plan_.options.precision));
  }

  int new_root(std::size_t bytes) {
    roots_.push_back({bytes, kForever, -1, {}});
    return static_cast<int>(roots_.size()) - 1;
  }

  void put(Key k, const Placement& place, int made_at) {
    places_[k] = place;
    if (place.where != Placement::Where::Arena) return;
    Root& root = roots_[static_cast<std::size_t>(place.slot)];
    root.first = std::min(root.first, made_at);
    root.last = std::max(root.last, last_use_[k]);
    root.members.push_back(k);
  }

  Placement fresh(const Signature& s) {
    return {Placement::Where::Arena, new_root(bytes_of(s)), 0, static_cast<int>(s.shape.item())};
  }

  /// Inputs of a concatenation are written straight to their place in it. Last concatenation first, so that a chain
  /// of them (a dense block) shares the memory of its last link.
  void place_gathered() {
    int shared = 0;
    for (std::size_t i = order_.size(); i-- > 0;) {
      const Node& node = *order_[i];
      if (!node.op->gathers_inputs()) continue;
      const Key out{node.id, 0};
      if (!places_.count(out)) put(out, fresh(node.outputs[0]), static_cast<int>(i));
      const Placement whole = places_[out];
      std::uint64_t offset = whole.offset;
      for (const Value& v : node.inputs) {
        const bool free = !places_.count(key(v)) && v.node->op->view_offset(*v.node) < 0;
        if (free) {
          put(key(v), {Placement::Where::Arena, whole.slot, offset, whole.stride}, position_[v.node->id]);
          ++shared;
        }
        offset += static_cast<std::uint64_t>(v.shape().item());
      }
    }
    plan_.notes.push_back(fmt::format("alias: {} values written in place into concatenations", shared));
  }

  void place_rest() {
    int views = 0, in_place = 0;
    for (std::size_t i = 0; i < order_.size(); ++i) {
      const Node& node = *order_[i];
      for (int o = 0; o < static_cast<int>(node.outputs.size()); ++o) {
        const Key k{node.id, o};
        if (places_.count(k)) continue;
        if (o == 0 && plan_.options.alias && try_view(node, static_cast<int>(i)))
          ++views;
        else if (o == 0 && plan_.options.alias && try_in_place(node, static_cast<int>(i)))
          ++in_place;
        else
          put(k, fresh(node.outputs[static_cast<std::size_t>(o)]), static_cast<int>(i));
      }
      if (const std::size_t elements = node.op->workspace(node)) {
        const int root = new_root(elements * real_size(plan_.options.precision));
        roots_.back().first = roots_.back().last = static_cast<int>(i);
        workspaces_[node.id] = {Placement::Where::Arena, root, 0,
                                static_cast<int>(std::min<std::size_t>(elements, 0x7fffffff))};
      }
    }
    plan_.notes.push_back(fmt::format("alias: {} views, {} values computed in place", views, in_place));
  }

  bool try_view(const Node& node, int position) {
    const long offset = node.op->view_offset(node);
    if (offset < 0) return false;
    const Shape &in = node.in_shape(0), &out = node.outputs[0].shape;
    Placement place = places_[key(node.inputs[0])];
    const bool contiguous = in.n == 1 || place.stride == in.item();
    if (in.n != out.n && !contiguous) return false;
    if (in.n != out.n) place.stride = static_cast<int>(out.item());
    place.offset += static_cast<std::uint64_t>(offset);
    put({node.id, 0}, place, position);
    return true;
  }

  bool try_in_place(const Node& node, int position) {
    const int input = node.op->overwrites();
    if (input < 0) return false;
    const Value v = node.inputs[static_cast<std::size_t>(input)];
    const Placement place = places_[key(v)];
    if (place.where != Placement::Where::Arena || !(v.shape() == node.outputs[0].shape) ||
        v.type() != node.outputs[0].type)
      return false;
    for (const Key& member : roots_[static_cast<std::size_t>(place.slot)].members)
      if (last_use_[member] > position) return false;
    for (const Value& other : node.inputs) {  // another view of the same memory would be overwritten while it is read
      const Placement& p = places_[key(other)];
      const bool same_root = p.where == Placement::Where::Arena && p.slot == place.slot;
      if (same_root && (p.offset != place.offset || p.stride != place.stride)) return false;
    }
    put({node.id, 0}, place, position);
    return true;
  }

  /// Greedy by size: each root takes the lowest place that no root alive at the same time holds.
  void pack() {
    std::vector<int> by_size(roots_.size());
    std::iota(by_size.begin(), by_size.end(), 0);
    std::stable_sort(by_size.begin(), by_size.end(), [&](int a, int b) {
      return roots_[static_cast<std::size_t>(a)].bytes > roots_[static_cast<std::size_t>(b)].bytes;
    });
    plan_.roots.assign(roots_.size(), 0);
    std::vector<int> placed;
    std::size_t total = 0;
    for (const int r : by_size) {
      const Root& root = roots_[static_cast<std::size_t>(r)];
      const std::size_t size = (root.bytes + kAlignment - 1) / kAlignment * kAlignment;
      std::vector<std::pair<std::size_t, std::size_t>> taken;  // begin, end
      for (const int other : placed) {
        const Root& o = roots_[static_cast<std::size_t>(other)];
        if (!plan_.options.reuse || (o.first <= root.last && root.first <= o.last))
          taken.emplace_back(
              plan_.roots[static_cast<std::size_t>(other)],
              plan_.roots[static_cast<std::size_t>(other)] + (o.bytes + kAlignment - 1) / kAlignment * kAlignment);
      }
      std::sort(taken.begin(), taken.end());
      std::size_t at = 0;
      for (const auto& [begin, end] : taken) {
        if (at + size <= begin) break;
        at = std::max(at, end);
      }
      plan_.roots[static_cast<std::size_t>(r)] = at;
      plan_.arena_bytes = std::max(plan_.arena_bytes, at + size);
      total += size;
      placed.push_back(r);
    }
    plan_.notes.push_back(fmt::format("arena: {:.1f} MiB for {:.1f} MiB of values",
                                      static_cast<double>(plan_.arena_bytes) / 0x1p20,
                                      static_cast<double>(total) / 0x1p20));
  }

  void emit() {
    for (const Node* node : order_) {
      Step step;
      step.node = node;
      for (const Value& v : node->inputs) step.inputs.push_back(places_[key(v)]);
      for (int o = 0; o < static_cast<int>(node->outputs.size()); ++o) step.outputs.push_back(places_[{node->id, o}]);
      if (workspaces_.count(node->id)) step.workspace = workspaces_[node->id];
      if (const Body body = node->op->body(); body.graph) add_body(step, body);
      plan_.steps.push_back(std::move(step));
    }
    for (const Value& v : plan_.outputs) plan_.output_places.push_back(places_[key(v)]);
  }

  void add_body(Step& step, const Body& body) {
    step.body = std::make_shared<const Plan>(compile(*body.graph, body.outputs, plan_.device, plan_.options));
    step.times = body.times;
    plan_.notes.push_back(fmt::format("{}: {} runs of a body", step.node->op->name(), body.times));
    for (const std::string& note : step.body->notes) plan_.notes.push_back("  " + note);
  }

  const Graph& graph_;
  Plan plan_;
  std::vector<const Node*> order_;
  std::map<int, int> position_;
  std::map<Key, int> last_use_;
  std::map<Key, Placement> places_;
  std::map<int, Placement> workspaces_;
  std::vector<Root> roots_;
};

}  // namespace

std::size_t Plan::memory() const {
  std::size_t bytes = arena_bytes;
  for (const Step& step : steps)
    if (step.body) bytes += step.body->memory();
  return bytes;
}

Plan compile(const Graph& graph, std::vector<Value> outputs, Device device, const PlanOptions& options, bool updates) {
  return Compiler(graph, std::move(outputs), std::move(device), options, updates).take();
}

}  // namespace clerestory
