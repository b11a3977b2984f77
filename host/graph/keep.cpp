#include "host/graph/keep.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "host/graph/replay.hpp"

namespace clerestory {
namespace {

const Chunked* chunked(const Node& node) { return dynamic_cast<const Chunked*>(node.op.get()); }

/// What a replaying body reads of nodes that are worth keeping; what it would compute for those alone is not looked at.
std::vector<Value> worth_keeping(const Node& node) {
  const Chunked& op = *chunked(node);
  std::vector<Value> open = node.op->body().outputs, found;
  std::set<const Node*> seen;
  while (!open.empty()) {
    const Value v = open.back();
    open.pop_back();
    if (dynamic_cast<const WorthKeeping*>(v.node->op.get()) && op.first_of(v)) {
      if (std::ranges::count(found, v) == 0) found.push_back(v);
    } else if (seen.insert(v.node).second) {
      open.insert(open.end(), v.node->inputs.begin(), v.node->inputs.end());
    }
  }
  return found;
}

std::string names_of(std::span<const Value> values) {
  std::set<std::string> names;
  for (const Value& v : values) names.insert(v.node->op->name());
  return fmt::format("{}", fmt::join(names, ", "));
}

class Keeper {
 public:
  Keeper(Schedule& schedule, const PlanOptions& options, std::deque<Node>& made)
      : s_(schedule), options_(options), made_(made) {}

  std::vector<std::string> run() {
    choose();
    for (const auto& [task, values] : kept_) have_kept(task, values);
    for (const auto& [task, values] : given_) give(task, values);
    return std::move(notes_);
  }

 private:
  const Node& node(int task) const { return *s_.tasks[index(task)].node; }

  void choose() {
    const std::vector<int> position = s_.positions();
    for (const int t : s_.order) {
      const Chunked* op = chunked(node(t));
      const Node* first = op ? op->replayed() : nullptr;
      // Who alone wants gradients of a node has no need of its outputs, and it does not run before its replay. Adjoints
      // of adjoints compute all of it again.
      if (!first || position[index(first->id)] < 0 || chunked(*first)->replayed()) continue;
      if (const std::vector<Value> values = worth_keeping(node(t)); !values.empty()) choose(t, *first, values);
    }
  }

  void choose(int task, const Node& first, const std::vector<Value>& values) {
    std::vector<Value> all = kept_.contains(first.id) ? kept_.at(first.id) : std::vector<Value>{};
    std::size_t bytes = 0;
    for (const Value& v : values) {
      const Value there = chunked(node(task))->first_of(v);
      if (std::ranges::count(all, there) > 0) continue;
      all.push_back(there);
      bytes += bytes_of(chunked(first)->in_all_chunks(there), options_.precision);
    }
    constexpr double kMiB = 0x1p20;
    const double mib = static_cast<double>(bytes) / kMiB, left = static_cast<double>(options_.keep - bytes_) / kMiB;
    const bool fits = bytes <= options_.keep - bytes_;
    notes_.push_back(fits ? fmt::format("keep: {:.1f} MiB of {}, which the adjoint of {} does not run again", mib,
                                        names_of(values), first.op->name())
                          : fmt::format("keep: {:.1f} MiB of {} are more than {:.1f}: the adjoint of {} runs it again",
                                        mib, names_of(values), left, first.op->name()));
    if (!fits) return;
    bytes_ += bytes;
    kept_[first.id] = std::move(all), given_[task] = values;
  }

  /// The task runs the same node, but for its op.
  Node& remade(int task, std::unique_ptr<const Op> op) {
    const Node& before = node(task);
    Node& after = made_.emplace_back();
    after.id = before.id, after.graph = before.graph, after.draws = before.draws;
    after.inputs = before.inputs, after.outputs = before.outputs;
    after.op = std::move(op);
    s_.tasks[index(task)].node = &after;
    return after;
  }

  void have_kept(int task, const std::vector<Value>& values) {
    const Chunked& op = *chunked(node(task));
    Node& after = remade(task, op.keeping(values));
    for (const Value& v : values) after.outputs.push_back(op.in_all_chunks(v));
  }

  void give(int task, const std::vector<Value>& values) {
    const Chunked& op = *chunked(node(task));
    const Node& first = node(op.replayed()->id);
    const std::vector<Value>& kept = kept_.at(first.id);
    Node& after = remade(task, op.given(values));
    for (const Value& v : values) {
      const auto which = std::ranges::find(kept, op.first_of(v)) - kept.begin();
      const int output = static_cast<int>(first.outputs.size() - kept.size()) + static_cast<int>(which);
      after.inputs.push_back(first.value(output));
      s_.tasks[index(task)].inputs.push_back({first.id, output});
    }
  }

  Schedule& s_;
  const PlanOptions& options_;
  std::deque<Node>& made_;
  std::map<int, std::vector<Value>> kept_;   // of the bodies of tasks that are replayed
  std::map<int, std::vector<Value>> given_;  // of the bodies of tasks that replay them
  std::size_t bytes_ = 0;
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<std::string> keep_for_replays(Schedule& schedule, const PlanOptions& options, std::deque<Node>& made) {
  return Keeper(schedule, options, made).run();
}

}  // namespace clerestory
