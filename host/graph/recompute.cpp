#include "host/graph/recompute.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>

namespace clerestory {
namespace {

constexpr int kForever = std::numeric_limits<int>::max();
constexpr double kBalance = 20;         // flops that take as long as moving a byte: 300 GFLOP/s beside 15 GB/s
constexpr std::size_t kMostAgain = 24;  // tasks for one piece of memory

double work_of(const Node& node) {
  if (node.op->view_offset(node) >= 0 || node.op->gathers_inputs()) return 0;
  const Cost cost = node.op->cost(node);
  return cost.flops + kBalance * cost.bytes;
}

/// A piece of memory that is let go at a step, and what makes its values again later.
struct Candidate {
  TaskValue piece;                // its first value
  std::vector<TaskValue> values;  // that are read later
  std::vector<int> again;         // tasks, in order
  int before = 0;                 // task: the first that reads one of the values
  std::size_t saved = 0;
  double work = 0;
};

/// What is needed to judge one schedule.
class Finder {
 public:
  Finder(const Schedule& s, const Layout& layout, const PlanOptions& options)
      : s_(s), layout_(layout), options_(options), position_(s.positions()), states_(seen_states(s)) {
    uses_.resize(s.tasks.size());
    for (std::size_t t = 0; t < s.tasks.size(); ++t) uses_[t].resize(s.tasks[t].node->outputs.size());
    for (const int t : s.order) {
      const Task& task = s.tasks[index(t)];
      for (const TaskValue& v : task.inputs) uses(v).push_back(position_[index(t)]);
      for (const int written : task.node->op->writes())
        written_at_.emplace(states_[index(task.inputs[index(written)].task)], position_[index(t)]);
    }
    for (const TaskValue& v : s.outputs) uses(v).push_back(kForever);
  }

  /// Best first.
  std::vector<Candidate> at(int step, const std::set<TaskValue>& but) {
    std::vector<Candidate> found;
    for (const Root& root : layout_.roots)
      if (!root.members.empty() && !but.contains(root.members.front()))
        if (auto candidate = without(root, step)) found.push_back(std::move(*candidate));
    std::ranges::stable_sort(found, std::greater<>(),
                             [](const Candidate& c) { return static_cast<double>(c.saved) / (c.work + 1); });
    return found;
  }

 private:
  std::vector<int>& uses(TaskValue v) { return uses_[index(v.task)][index(v.output)]; }

  std::optional<Candidate> without(const Root& root, int step) {
    if (root.first >= step || root.last <= step || root.last == kForever) return std::nullopt;
    Candidate c;
    int first = kForever;
    for (const TaskValue& v : root.members) {
      if (position_[index(v.task)] == step) return std::nullopt;
      if (position_[index(v.task)] > step) continue;  // made in place of what is made again, or beside it
      const std::vector<int>& read = uses(v);
      const auto later = std::ranges::lower_bound(read, step);
      if (later == read.end()) continue;
      if (*later == step) return std::nullopt;
      c.values.push_back(v);
      first = std::min(first, *later);
    }
    if (c.values.empty()) return std::nullopt;
    std::set<int> again;
    std::size_t kept = 0;
    for (const TaskValue& v : c.values)
      if (!make(v, root, first, again, kept)) return std::nullopt;
    if (root.bytes <= kept) return std::nullopt;
    c.piece = root.members.front(), c.saved = root.bytes - kept, c.before = s_.order[index(first)];
    c.again.assign(again.begin(), again.end());
    std::ranges::sort(c.again, {}, [&](int t) { return position_[index(t)]; });
    for (const int t : c.again) c.work += work_of(*s_.tasks[index(t)].node);
    return c;
  }

  /// Adds what has to run again for v to be there at `step` without the root; `kept`: bytes that live longer for it.
  bool make(TaskValue v, const Root& root, int step, std::set<int>& again, std::size_t& kept) {
    if (again.contains(v.task)) return true;
    const int state = states_[index(v.task)];
    if (const auto written = written_at_.lower_bound(state); state >= 0 && written != written_at_.end())
      if (written->first == state && written->second < step) return false;  // it is another by then
    if (s_.leaf(v.task)) return true;
    const Placement& place = layout_.place(v);
    const bool in_root = place.where == Placement::Where::Arena && &layout_.roots[index(place.slot)] == &root;
    const std::vector<int>& read = uses(v);
    if (!in_root && !read.empty() && read.back() >= step) return true;
    const Node& node = *s_.tasks[index(v.task)].node;
    if (!node.op->writes().empty() || node.op->body().graph) {
      if (in_root) return false;
      kept += bytes_of(s_.signature(v), options_.precision);
      return true;
    }
    again.insert(v.task);
    if (again.size() > kMostAgain) return false;
    return std::ranges::all_of(s_.tasks[index(v.task)].inputs,
                               [&](const TaskValue& in) { return make(in, root, step, again, kept); });
  }

  const Schedule& s_;
  const Layout& layout_;
  const PlanOptions& options_;
  std::vector<int> position_, states_;
  std::vector<std::vector<std::vector<int>>> uses_;  // positions, by task and output
  std::multimap<int, int> written_at_;               // state -> position, the first first
};

Schedule with(Schedule s, std::span<const Candidate> chosen, int step) {
  std::map<int, std::vector<int>> inserted;  // before a task
  std::map<TaskValue, TaskValue> replaced;
  for (const Candidate& c : chosen) {
    std::map<int, int> copies;
    for (const int t : c.again) {
      const int copy = static_cast<int>(s.tasks.size());
      Task task = s.tasks[index(t)];
      for (TaskValue& v : task.inputs)
        if (const auto made = copies.find(v.task); made != copies.end()) v.task = made->second;
      s.tasks.push_back(std::move(task));
      copies[t] = copy;
      inserted[c.before].push_back(copy);
    }
    for (const TaskValue& v : c.values) replaced[v] = {copies.at(v.task), v.output};
  }
  std::vector<int> order;
  for (std::size_t i = 0; i < s.order.size(); ++i) {
    const int t = s.order[i];
    if (const auto found = inserted.find(t); found != inserted.end())
      order.insert(order.end(), found->second.begin(), found->second.end());
    order.push_back(t);
    if (static_cast<int>(i) <= step) continue;
    for (TaskValue& v : s.tasks[index(t)].inputs)
      if (const auto found = replaced.find(v); found != replaced.end()) v = found->second;
  }
  s.order = std::move(order);
  return s;
}

/// The most bytes alive, and how far steps are above the goal, all together.
std::pair<std::size_t, double> pressure(const std::vector<std::size_t>& alive, std::size_t goal) {
  std::pair<std::size_t, double> p{0, 0};
  for (const std::size_t bytes : alive) {
    p.first = std::max(p.first, bytes);
    if (bytes > goal) p.second += static_cast<double>(bytes - goal);
  }
  return p;
}

}  // namespace

void recompute(Schedule& schedule, Layout& layout, const PlanOptions& options, std::size_t goal) {
  std::set<TaskValue> useless;
  while (true) {
    const std::vector<std::size_t> alive = layout.alive(schedule.order.size());
    const auto most = std::ranges::max_element(alive);
    if (most == alive.end() || *most <= goal) return;
    const int step = static_cast<int>(most - alive.begin());
    std::vector<Candidate> chosen = Finder(schedule, layout, options).at(step, useless);
    std::size_t enough = 0;  // candidates, for this step
    for (std::size_t saved = 0; enough < chosen.size() && *most > goal + saved; ++enough) saved += chosen[enough].saved;
    const auto before = pressure(alive, goal);
    bool better = false;
    for (; enough > 0 && !better; enough = better ? enough : enough / 2) {
      Schedule trial = with(schedule, std::span(chosen).first(enough), step);
      Layout laid = lay_out(trial, options);
      better = pressure(laid.alive(trial.order.size()), goal) < before;
      if (better) schedule = std::move(trial), layout = std::move(laid);
    }
    if (better) continue;
    if (chosen.empty()) return;
    useless.insert(chosen.front().piece);
  }
}

}  // namespace clerestory
