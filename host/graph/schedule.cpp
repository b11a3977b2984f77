#include "host/graph/schedule.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <queue>
#include <set>

namespace clerestory {
namespace {

/// By task: the tasks that have to run before it. Beside those whose outputs it reads: whoever reads a state reads it
/// before it is written by an update that came later, and after one that came earlier.
std::vector<std::vector<int>> predecessors(const Schedule& s) {
  std::vector<std::vector<int>> before(s.tasks.size());
  const std::vector<int> states = seen_states(s);
  struct Touched {
    int writer = -1;
    std::vector<int> readers;  // since then
  };
  std::map<int, Touched> touched;
  for (const int t : s.order) {
    const Task& task = s.tasks[index(t)];
    const std::vector<int> written = task.node->op->writes();
    for (std::size_t i = 0; i < task.inputs.size(); ++i) {
      const TaskValue v = task.inputs[i];
      if (!s.leaf(v.task)) before[index(t)].push_back(v.task);
      const int state = v.output == 0 ? states[index(v.task)] : -1;
      if (state < 0) continue;
      Touched& found = touched[state];
      if (found.writer >= 0) before[index(t)].push_back(found.writer);
      if (std::ranges::find(written, static_cast<int>(i)) == written.end()) {
        found.readers.push_back(t);
        continue;
      }
      for (const int reader : found.readers)
        if (reader != t) before[index(t)].push_back(reader);
      found = {t, {}};
    }
  }
  return before;
}

}  // namespace

bool Schedule::leaf(int task) const {
  const Op* op = tasks[index(task)].node->op.get();
  return dynamic_cast<const InputOp*>(op) || dynamic_cast<const StateOp*>(op) || dynamic_cast<const ConstantOp*>(op);
}

std::vector<int> Schedule::positions() const {
  std::vector<int> positions(tasks.size(), -1);
  for (std::size_t i = 0; i < order.size(); ++i) positions[index(order[i])] = static_cast<int>(i);
  return positions;
}

std::size_t bytes_of(const Signature& s, Precision precision) {
  return static_cast<std::size_t>(s.shape.count()) * (s.type == Type::Int ? 4 : real_size(precision));
}

std::vector<int> seen_states(const Schedule& s) {
  std::vector<int> states(s.tasks.size(), -1);
  for (std::size_t t = 0; t < s.tasks.size(); ++t) {
    int at = static_cast<int>(t);
    for (const Task* task = &s.tasks[t]; task->node->op->view_offset(*task->node) >= 0; task = &s.tasks[index(at)]) {
      if (task->inputs[0].output != 0) break;
      at = task->inputs[0].task;
    }
    if (dynamic_cast<const StateOp*>(s.tasks[index(at)].node->op.get())) states[t] = at;
  }
  return states;
}

Schedule schedule_as_made(const Graph& graph, const std::vector<Value>& outputs, bool prune, bool updates,
                          std::span<const Given> given) {
  Schedule s;
  const std::size_t count = graph.nodes().size();
  std::vector<bool> needed(count + given.size(), !prune);
  std::map<TaskValue, TaskValue> instead;
  for (const Given& g : given) instead[{g.value.node->id, g.value.output}] = {g.input->id, 0};
  const auto read = [&](const Value& v) {
    const TaskValue own{v.node->id, v.output};
    const auto found = instead.find(own);
    return found == instead.end() ? own : found->second;
  };
  for (const Value& v : outputs) {
    s.outputs.push_back(read(v));
    needed[index(s.outputs.back().task)] = true;
  }
  for (const Node& node : graph.nodes()) {
    if (!node.op->writes().empty()) needed[index(node.id)] = updates;
    Task& task = s.tasks.emplace_back();
    task.node = &node;
    for (const Value& v : node.inputs) task.inputs.push_back(read(v));
  }
  for (const Given& g : given) s.tasks.push_back({g.input, {}});
  for (std::size_t id = count; id-- > 0;)
    if (needed[id])
      for (const TaskValue& v : s.tasks[id].inputs) needed[index(v.task)] = true;
  for (const bool update : {false, true})
    for (const Node& node : graph.nodes()) {
      if (!needed[index(node.id)] || node.op->writes().empty() == update) continue;
      if (s.leaf(node.id))
        s.leaves.push_back(&node);
      else
        s.order.push_back(node.id);
    }
  for (const Given& g : given)
    if (needed[index(g.input->id)]) s.leaves.push_back(g.input);
  return s;
}

Schedule last_made_first(Schedule s) {
  const std::vector<std::vector<int>> before = predecessors(s);
  std::vector<std::vector<int>> after(s.tasks.size());
  std::vector<std::size_t> waits(s.tasks.size(), 0);
  std::priority_queue<int> ready;
  for (const int t : s.order) {
    waits[index(t)] = before[index(t)].size();
    for (const int b : before[index(t)]) after[index(b)].push_back(t);
    if (waits[index(t)] == 0) ready.push(t);
  }
  s.order.clear();
  while (!ready.empty()) {
    const int t = ready.top();
    ready.pop();
    s.order.push_back(t);
    for (const int next : after[index(t)])
      if (--waits[index(next)] == 0) ready.push(next);
  }
  return s;
}

Schedule when_read(Schedule s, Precision precision) {
  const std::vector<std::vector<int>> before = predecessors(s);
  std::map<TaskValue, int> last_reader;
  std::vector<bool> read(s.tasks.size(), false);
  for (const int t : s.order)
    for (const TaskValue& v : s.tasks[index(t)].inputs) last_reader[v] = t, read[index(v.task)] = true;
  for (const TaskValue& v : s.outputs) last_reader[v] = -1;

  const auto waits = [&](int t) {
    if (!read[index(t)]) return false;
    std::size_t made = 0, given_back = 0;
    for (std::size_t o = 0; o < s.tasks[index(t)].node->outputs.size(); ++o)
      made += bytes_of(s.signature({t, static_cast<int>(o)}), precision);
    const std::vector<TaskValue>& inputs = s.tasks[index(t)].inputs;
    for (const TaskValue& v : std::set<TaskValue>(inputs.begin(), inputs.end()))
      if (!s.leaf(v.task) && last_reader[v] == t) given_back += bytes_of(s.signature(v), precision);
    return made > given_back;
  };
  const std::vector<int> old = std::move(s.order);
  s.order.clear();
  std::vector<bool> done(s.tasks.size(), false);
  const std::function<void(int)> run = [&](int t) {
    if (done[index(t)]) return;
    done[index(t)] = true;
    for (const int b : before[index(t)]) run(b);
    s.order.push_back(t);
  };
  for (const int t : old)
    if (!waits(t)) run(t);
  for (const int t : old) run(t);  // outputs that nobody else reads
  return s;
}

}  // namespace clerestory
