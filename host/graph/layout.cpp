#include "host/graph/layout.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace clerestory {
namespace {

constexpr int kForever = std::numeric_limits<int>::max();
constexpr std::size_t kAlignment = 256;  // bytes: beyond any device's need, and a multiple of every vector

std::size_t aligned(std::size_t bytes) { return (bytes + kAlignment - 1) / kAlignment * kAlignment; }

class Builder {
 public:
  Builder(const Schedule& schedule, const PlanOptions& options)
      : s_(schedule), options_(options), position_(schedule.positions()) {
    const std::size_t tasks = s_.tasks.size();
    out_.places.resize(tasks), out_.workspaces.resize(tasks), placed_.resize(tasks), last_use_.resize(tasks);
    for (std::size_t t = 0; t < tasks; ++t) {
      const std::size_t outputs = s_.tasks[t].node->outputs.size();
      out_.places[t].resize(outputs), placed_[t].assign(outputs, false), last_use_[t].assign(outputs, position_[t]);
    }
    place_leaves();
    find_last_uses();
    if (options_.alias) place_gathered();
    place_rest();
  }

  Layout take() { return std::move(out_); }

 private:
  const Node& node(int task) const { return *s_.tasks[index(task)].node; }
  int& last_use(TaskValue v) { return last_use_[index(v.task)][index(v.output)]; }
  bool placed(TaskValue v) const { return placed_[index(v.task)][index(v.output)]; }

  void place_leaves() {
    int inputs = 0, states = 0, constants = 0;
    for (const Node* leaf : s_.leaves) {
      using Where = Placement::Where;
      const int stride = static_cast<int>(leaf->outputs[0].shape.item());
      const auto place = [&](Where where, int& count) {
        out_.places[index(leaf->id)][0] = {where, count++, 0, stride};
      };
      if (dynamic_cast<const InputOp*>(leaf->op.get()))
        place(Where::Input, inputs);
      else if (dynamic_cast<const StateOp*>(leaf->op.get()))
        place(Where::State, states);
      else
        place(Where::Constant, constants);
      placed_[index(leaf->id)][0] = true;
    }
  }

  void find_last_uses() {
    for (const int t : s_.order)
      for (const TaskValue& v : s_.tasks[index(t)].inputs) last_use(v) = position_[index(t)];
    for (const TaskValue& v : s_.outputs) last_use(v) = kForever;
  }

  void put(TaskValue v, const Placement& place) {
    out_.places[index(v.task)][index(v.output)] = place;
    placed_[index(v.task)][index(v.output)] = true;
    if (place.where != Placement::Where::Arena) return;
    Root& root = out_.roots[index(place.slot)];
    const int made_at = position_[index(v.task)];
    root.first = root.members.empty() ? made_at : std::min(root.first, made_at);
    root.last = std::max(root.last, last_use(v));
    root.members.push_back(v);
  }

  Placement fresh(const Signature& signature) {
    out_.roots.push_back({bytes_of(signature, options_.precision), 0, -1, {}});
    return {Placement::Where::Arena, static_cast<int>(out_.roots.size()) - 1, 0,
            static_cast<int>(signature.shape.item())};
  }

  /// Inputs of a concatenation are written straight to their place in it. Last concatenation first, so that a chain
  /// of them (a dense block) shares the memory of its last link.
  void place_gathered() {
    for (std::size_t i = s_.order.size(); i-- > 0;) {
      const int t = s_.order[i];
      if (!node(t).op->gathers_inputs()) continue;
      const TaskValue out{t, 0};
      if (!placed(out)) put(out, fresh(s_.signature(out)));
      const Placement whole = out_.place(out);
      std::uint64_t offset = whole.offset;
      for (const TaskValue& v : s_.tasks[index(t)].inputs) {
        if (!placed(v) && node(v.task).op->view_offset(node(v.task)) < 0) {
          put(v, {Placement::Where::Arena, whole.slot, offset, whole.stride});
          ++out_.gathered;
        }
        offset += static_cast<std::uint64_t>(s_.signature(v).shape.item());
      }
    }
  }

  void place_rest() {
    for (std::size_t i = 0; i < s_.order.size(); ++i) {
      const int t = s_.order[i];
      for (int o = 0; o < static_cast<int>(node(t).outputs.size()); ++o) {
        const TaskValue v{t, o};
        if (placed(v)) continue;
        if (o == 0 && options_.alias && try_view(t))
          ++out_.views;
        else if (o == 0 && options_.alias && try_in_place(t))
          ++out_.in_place;
        else
          put(v, fresh(s_.signature(v)));
      }
      if (const std::size_t elements = node(t).op->workspace(node(t))) {
        const int at = static_cast<int>(i);
        out_.roots.push_back({elements * real_size(options_.precision), at, at, {}});
        out_.workspaces[index(t)] = {Placement::Where::Arena, static_cast<int>(out_.roots.size()) - 1, 0,
                                     static_cast<int>(std::min<std::size_t>(elements, 0x7fffffff))};
      }
    }
  }

  bool try_view(int t) {
    const long offset = node(t).op->view_offset(node(t));
    if (offset < 0) return false;
    const Shape &in = node(t).in_shape(0), &out = node(t).outputs[0].shape;
    Placement place = out_.place(s_.tasks[index(t)].inputs[0]);
    const bool contiguous = in.n == 1 || place.stride == in.item();
    if (in.n != out.n && !contiguous) return false;
    if (in.n != out.n) place.stride = static_cast<int>(out.item());
    place.offset += static_cast<std::uint64_t>(offset);
    put({t, 0}, place);
    return true;
  }

  bool try_in_place(int t) {
    const int input = node(t).op->overwrites();
    if (input < 0) return false;
    const std::vector<TaskValue>& inputs = s_.tasks[index(t)].inputs;
    const Signature &from = s_.signature(inputs[index(input)]), &to = node(t).outputs[0];
    const Placement place = out_.place(inputs[index(input)]);
    if (place.where != Placement::Where::Arena || !(from.shape == to.shape) || from.type != to.type) return false;
    for (const TaskValue& member : out_.roots[index(place.slot)].members)
      if (last_use(member) > position_[index(t)]) return false;
    for (const TaskValue& other : inputs) {  // another view of the same memory would be overwritten while it is read
      const Placement& p = out_.place(other);
      const bool same_root = p.where == Placement::Where::Arena && p.slot == place.slot;
      const bool same = p.offset == place.offset && p.stride == place.stride && s_.signature(other).shape == from.shape;
      if (same_root && !same) return false;
    }
    put({t, 0}, place);
    return true;
  }

  const Schedule& s_;
  const PlanOptions& options_;
  std::vector<int> position_;
  std::vector<std::vector<bool>> placed_;
  std::vector<std::vector<int>> last_use_;
  Layout out_;
};

/// Each root in this sequence takes the lowest place that no root alive at the same time holds.
Packing pack_in(const std::vector<Root>& roots, const std::vector<int>& sequence, bool reuse) {
  Packing p{std::vector<std::size_t>(roots.size(), 0), 0};
  std::vector<std::pair<std::size_t, int>> placed;  // by offset
  for (const int r : sequence) {
    const Root& root = roots[index(r)];
    const std::size_t size = aligned(root.bytes);
    std::size_t at = 0;
    for (const auto& [begin, other] : placed) {
      const Root& o = roots[index(other)];
      if (reuse && (o.first > root.last || root.first > o.last)) continue;
      if (at + size <= begin) break;
      at = std::max(at, begin + aligned(o.bytes));
    }
    p.offsets[index(r)] = at;
    p.bytes = std::max(p.bytes, at + size);
    const std::pair<std::size_t, int> entry{at, r};
    placed.insert(std::upper_bound(placed.begin(), placed.end(), entry), entry);
  }
  return p;
}

/// Steps up to the last one at which a root is made.
std::size_t steps_of(const std::vector<Root>& roots) {
  int steps = 0;
  for (const Root& root : roots) steps = std::max(steps, root.first + 1);
  return index(steps);
}

std::vector<std::size_t> alive_of(const std::vector<Root>& roots, std::size_t steps) {
  std::vector<std::size_t> bytes(steps + 1, 0);  // first by how much they change, and a decrease wraps around
  for (const Root& root : roots) {
    bytes[index(root.first)] += aligned(root.bytes);
    bytes[std::min(steps, index(root.last) + 1)] -= aligned(root.bytes);
  }
  std::partial_sum(bytes.begin(), bytes.end(), bytes.begin());
  bytes.resize(steps);
  return bytes;
}

/// Packs anew with what lay on top put first, as long as that may help.
Packing improved(Packing best, const std::vector<Root>& roots, std::vector<int> sequence) {
  constexpr int kTries = 24;
  const std::vector<std::size_t> alive = alive_of(roots, steps_of(roots));
  const std::size_t least = alive.empty() ? 0 : *std::ranges::max_element(alive);
  Packing packing = best;
  for (int i = 0; i < kTries && best.bytes > least; ++i) {
    const auto on_top = std::ranges::find_if(
        sequence, [&](int r) { return packing.offsets[index(r)] + aligned(roots[index(r)].bytes) == packing.bytes; });
    std::rotate(sequence.begin(), on_top, on_top + 1);
    packing = pack_in(roots, sequence, true);
    if (packing.bytes < best.bytes) best = packing;
  }
  return best;
}

}  // namespace

std::vector<std::size_t> Layout::alive(std::size_t steps) const { return alive_of(roots, steps); }

Layout lay_out(const Schedule& schedule, const PlanOptions& options) { return Builder(schedule, options).take(); }

Packing pack(const std::vector<Root>& roots, bool reuse) {
  std::vector<int> sequence(roots.size());
  std::iota(sequence.begin(), sequence.end(), 0);
  const auto packed = [&] {
    Packing first = pack_in(roots, sequence, reuse);
    return reuse ? improved(std::move(first), roots, sequence) : first;
  };
  std::ranges::stable_sort(sequence, std::greater<>(), [&](int r) { return roots[index(r)].bytes; });
  Packing large_first = packed();
  std::ranges::stable_sort(sequence, std::greater<>(),
                           [&](int r) { return roots[index(r)].last - roots[index(r)].first; });
  Packing long_first = packed();
  return long_first.bytes < large_first.bytes ? long_first : large_first;
}

}  // namespace clerestory
