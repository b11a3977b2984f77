#include <algorithm>
#include <cmath>
#include <cstring>

#include "host/graph/states_in.hpp"
#include "host/graph/transfer.hpp"

namespace clerestory {
namespace {

/// SplitMix64: the stream of a state depends on its name and the seed, not on the order in which states are made.
struct Stream {
  std::uint64_t state;
  Stream(const std::string& name, std::uint64_t seed) : state(seed) {
    for (const char c : name) state = (state ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  }
  std::uint64_t next() {
    std::uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }  // in (0, 1)
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));  // first, whatever the compiler
    return radius * std::cos(6.283185307179586 * uniform());
  }
};

Tensor initial(const StateOp& state, std::uint64_t seed) {
  Tensor t(state.shape, state.init.value);
  if (state.init.kind == Init::Kind::Constant) return t;
  Stream stream(state.state_name, seed);
  for (double& x : t.real)
    x = state.init.value * (state.init.kind == Init::Kind::Normal ? stream.normal() : 2 * stream.uniform() - 1);
  return t;
}

}  // namespace

States::States(Device device, Precision precision) : device_(std::move(device)), precision_(precision) {}

void States::initialise(const Graph& graph, std::uint64_t seed) {
  for (const Value& v : graph.states()) {
    const auto& state = state_of(v);
    if (!has(state.state_name)) set(state.state_name, initial(state, seed));
    check_shape(state);
  }
}

void States::check_shape(const StateOp& state) const {
  if (const Shape& stored = view(state.state_name).shape; !(stored == state.shape))
    throw Error(ErrorKind::Failed, "a graph has another shape for a state", state.state_name, state.shape.text(),
                stored.text());
}

bool States::has(const std::string& name) const { return states_.count(name) > 0; }

TensorView States::view(const std::string& name) const {
  const auto found = states_.find(name);
  if (found == states_.end()) throw Error(ErrorKind::Failed, "there is no such state", name);
  return found->second;
}

Tensor States::get(const std::string& name) const { return download(device_, view(name), precision_); }

void States::set(const std::string& name, const Tensor& tensor) {
  TensorView& view = states_[name];
  if (!view.buffer)
    view = {device_.allocate(static_cast<std::size_t>(tensor.shape.count()) * real_size(precision_)), 0,
            static_cast<int>(tensor.shape.item()), tensor.shape, Type::Real};
  if (!(view.shape == tensor.shape))
    throw usage_error("a state has another shape", name, tensor.shape.text(), view.shape.text());
  upload(device_, view, tensor, precision_);
}

std::vector<std::string> States::names() const {
  std::vector<std::string> names;
  for (const auto& [name, view] : states_) names.push_back(name);
  return names;
}

std::shared_ptr<States> in_precision(const std::shared_ptr<States>& states, Precision precision) {
  if (!states || states->precision() == precision) return states;
  auto copy = std::make_shared<States>(states->device_, precision);
  for (const std::string& name : states->names()) copy->set(name, states->get(name));
  return copy;
}

}  // namespace clerestory
