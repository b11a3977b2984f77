#include "host/graph/map_chunks.hpp"

#include <algorithm>
#include <climits>

#include "host/graph/plan.hpp"
#include "host/graph/replay.hpp"

namespace clerestory {
namespace {

enum PlaceRule : int { kPut, kAdd, kKeep };  // of kernels/tensor/place.cl

using BuildBody = std::function<std::vector<ChunkOutput>(Graph&, std::span<const Value>)>;

/// The subgraph of one chunk. Its states live in the outer graph, under the same names.
struct Inner {
  Graph graph;
  std::vector<Value> inputs;
  std::vector<Value> states;  // in the order in which the outer node has them behind the inputs
  std::vector<ChunkOutput> outputs;

  /// What the outer node's input i is inside.
  Value reads(std::size_t i) const { return i < inputs.size() ? inputs[i] : states[i - inputs.size()]; }
  static std::string input_name(std::size_t i) { return fmt::format("input{}", i); }
};

/// The state of that name in another graph.
Value same_state(Graph& graph, const Value& state) {
  const auto& op = state_of(state);
  return graph.state(op.state_name, op.shape, op.init);
}

struct TakeOp : Op {
  int capacity;
  explicit TakeOp(int c) : capacity(c) {}
  std::string name() const override { return "take"; }
  std::vector<Signature> infer(std::span<const Value> in) const override {
    return {{{1, in[0].shape().c, capacity, 1}, Type::Real}};
  }
  std::vector<Value> adjoint(const Node& node, std::span<const Value> g) const override;
  void launch(Launch& l) const override {
    const Shape& whole = l.in(0).shape;
    l.run("tensor/place.cl", "take", Range::of2(static_cast<std::size_t>(capacity), static_cast<std::size_t>(whole.c)),
          l.in(0), l.out(), l.chunk.first_pixel, l.chunk.pixels, capacity, static_cast<int>(whole.plane()));
  }
  Cost cost(const Node& node) const override {  // of the whole map it reads the chunk
    return {0, 8 * static_cast<double>(node.outputs[0].shape.count())};
  }
};

/// The transpose of TakeOp: a whole map that is zero outside the chunk.
struct PutOp : NotDifferentiable {
  Shape whole;
  explicit PutOp(const Shape& s) : whole(s) {}
  std::string name() const override { return "put"; }
  std::vector<Signature> infer(std::span<const Value>) const override { return {{whole, Type::Real}}; }
  void launch(Launch& l) const override {
    const int capacity = l.in(0).shape.h, pixels = l.chunk.pixels > 0 ? l.chunk.pixels : capacity;
    for (int n = 0; n < whole.n; ++n)
      l.run("tensor/place.cl", "put",
            Range::of2(static_cast<std::size_t>(whole.plane()), static_cast<std::size_t>(whole.c)), l.in(0), l.out(), n,
            l.chunk.first_pixel, pixels, capacity, static_cast<int>(whole.plane()));
  }
};

/// A gradient that is zero outside of the chunk's pixels goes there; any other is added up as a whole.
ChunkOutput gradient_output(const Value& gradient, const ChunkDomain& domain) {
  const auto* put = dynamic_cast<const PutOp*>(gradient.node->op.get());
  if (put == nullptr || !(put->whole == Shape{domain.n, put->whole.c, domain.height, domain.width}))
    return {gradient, true};
  return {gradient.node->inputs[0], false};
}

std::vector<Value> TakeOp::adjoint(const Node& node, std::span<const Value> g) const {
  return {put_pixels(g[0], node.in_shape(0))};
}

struct Beginning;
Value make_map_chunks(Graph& graph, const ChunkDomain& domain, const std::vector<Value>& inputs, const BuildBody& build,
                      const Beginning& beginning);

/// A node whose body a body begins with, behind inputs of its own.
struct Beginning {
  const Node* node = nullptr;  // null: none
  int behind = 0;              // nodes of the body that come before those of the other one
};

struct MapChunksOp : Op, Chunked {
  ChunkDomain domain;
  BuildBody build;
  std::shared_ptr<const Inner> inner;
  Beginning begins;
  std::vector<Value> kept, not_computed;  // values of the body: outputs and inputs behind the others

  MapChunksOp(const ChunkDomain& d, BuildBody b, std::shared_ptr<const Inner> i, const Beginning& beginning)
      : domain(d), build(std::move(b)), inner(std::move(i)), begins(beginning) {
    for (const ChunkOutput& o : inner->outputs) {
      const Shape& s = o.value.shape();
      if (!o.total && (s.n != 1 || s.h != domain.chunk_pixels || s.w != 1))
        throw Error(ErrorKind::Failed, "a chunk's map has another shape", "map_chunks", s.text(),
                    fmt::format("1xCx{}x1", domain.chunk_pixels));
    }
  }

  std::string name() const override { return "map_chunks"; }

  std::vector<Signature> infer(std::span<const Value>) const override {
    std::vector<Signature> signatures;
    for (const ChunkOutput& o : inner->outputs)
      if (o.total)
        signatures.push_back({o.value.shape(), o.value.type()});
      else
        signatures.push_back({{domain.n, o.value.shape().c, domain.height, domain.width}, Type::Real});
    return signatures;
  }

  int pixels() const { return domain.n * domain.height * domain.width; }
  int chunks_of_samples() const { return (domain.samples + domain.chunk_samples - 1) / domain.chunk_samples; }
  int chunks() const {
    const int all = (pixels() + domain.chunk_pixels - 1) / domain.chunk_pixels * chunks_of_samples();
    return (all + domain.every - 1) / domain.every;
  }

  Body body() const override {
    Body body{&inner->graph, {}, chunks(), not_computed};
    for (const ChunkOutput& o : inner->outputs) body.outputs.push_back(o.value);
    body.outputs.insert(body.outputs.end(), kept.begin(), kept.end());
    return body;
  }

  const Node* replayed() const override { return begins.node; }

  Value first_of(Value v) const override {
    const Inner& first = *static_cast<const MapChunksOp&>(*begins.node->op).inner;
    const int id = v.node->id - begins.behind;
    if (id < static_cast<int>(first.inputs.size()) || id >= static_cast<int>(first.graph.nodes().size())) return {};
    return first.graph.nodes()[static_cast<std::size_t>(id)].value(v.output);
  }

  Signature in_all_chunks(Value v) const override {
    Shape s = v.shape();
    s.n *= chunks();
    return {s, v.type()};
  }

  std::unique_ptr<const Op> keeping(std::vector<Value> values) const override {
    auto op = std::make_unique<MapChunksOp>(*this);
    op->kept = std::move(values);
    return op;
  }

  std::unique_ptr<const Op> given(std::vector<Value> values) const override {
    auto op = std::make_unique<MapChunksOp>(*this);
    op->not_computed = std::move(values);
    return op;
  }

  void launch(Launch& l) const override {
    Executor& executor = *l.body;
    for (std::size_t i = 0; i < inner->inputs.size(); ++i) executor.bind(Inner::input_name(i), l.inputs[i]);
    int done = 0, at = 0;
    for (int pixel = 0; pixel < pixels(); pixel += domain.chunk_pixels)
      for (int sample = 0; sample < domain.samples; sample += domain.chunk_samples) {
        if (at++ % domain.every != 0) continue;
        const Chunk chunk{pixel, std::min(domain.chunk_pixels, pixels() - pixel), sample,
                          std::min(domain.chunk_samples, domain.samples - sample)};
        const std::size_t read = inner->inputs.size() + inner->states.size();
        for (std::size_t i = 0; i < not_computed.size(); ++i)
          executor.bind(Body::given_name(i), of_chunk(l.inputs[read + i], not_computed[i], done));
        executor.run(l.seed, chunk);
        collect(l, executor, chunk);
        for (std::size_t i = 0; i < kept.size(); ++i)
          copy(l, executor.view(kept[i]), of_chunk(l.outputs[inner->outputs.size() + i], kept[i], done));
        ++done;
        if (!l.after_chunk) continue;
        l.device.finish();
        (*l.after_chunk)(done, chunks());
      }
  }

  /// The part of a value's in_all_chunks() that a chunk has.
  static TensorView of_chunk(const TensorView& all, const Value& v, int chunk) {
    TensorView part = all.from(static_cast<std::uint64_t>(v.shape().count()) * static_cast<std::uint64_t>(chunk));
    part.shape = v.shape();
    return part;
  }

  /// Both are of one batch item each, or contiguous.
  static void copy(Launch& l, const TensorView& from, const TensorView& to) {
    const std::size_t size = from.type == Type::Int ? 4 : real_size(l.precision);
    l.device.copy(from.buffer, to.buffer, size * static_cast<std::size_t>(to.shape.count()), from.offset * size,
                  to.offset * size);
  }

  /// Item by item where either is a view of something larger.
  static void add_total(Launch& l, TensorView part, TensorView whole, bool add) {
    const long item = whole.shape.item();
    const bool one_run = part.stride == item && whole.stride == item && whole.shape.count() <= INT_MAX;
    const int items = one_run ? 1 : whole.shape.n, count = static_cast<int>(one_run ? whole.shape.count() : item);
    part.shape.n = whole.shape.n = 1;
    for (int n = 0; n < items; ++n) {
      l.run("tensor/place.cl", part.type == Type::Int ? "add_total_int" : "add_total",
            Range::of(static_cast<std::size_t>(count)), part, whole, count, static_cast<int>(add));
      part = part.from(static_cast<std::uint64_t>(part.stride));
      whole = whole.from(static_cast<std::uint64_t>(whole.stride));
    }
  }

  void collect(Launch& l, const Executor& executor, const Chunk& chunk) const {
    for (std::size_t o = 0; o < inner->outputs.size(); ++o) {
      const TensorView part = executor.view(inner->outputs[o].value);
      const TensorView& whole = l.outputs[o];
      if (inner->outputs[o].total) {
        add_total(l, part, whole, chunk.first_pixel > 0 || chunk.first_sample > 0);
      } else {
        l.run("tensor/place.cl", "place",
              Range::of2(static_cast<std::size_t>(chunk.pixels), static_cast<std::size_t>(part.shape.c)), part, whole,
              chunk.first_pixel, chunk.pixels, domain.chunk_pixels, domain.height * domain.width,
              chunk.first_sample == 0   ? kPut
              : inner->outputs[o].first ? kKeep
                                        : kAdd);
      }
    }
  }

  /// What collect() does; the body's own work is counted by the plan.
  Cost cost(const Node& node) const override {
    double flops = 0, numbers = 0;
    for (std::size_t o = 0; o < inner->outputs.size(); ++o) {
      const double count = static_cast<double>(node.outputs[o].shape.count());
      const double times = inner->outputs[o].total ? chunks() : chunks_of_samples();
      flops += count * (times - 1);              // the first is put there, others are added
      numbers += count * (2 + 3 * (times - 1));  // read and written; the sum so far is read, too
    }
    for (const Value& v : kept) numbers += 2.0 * static_cast<double>(v.shape().count()) * chunks();
    return {flops, 4 * numbers};
  }

  /// Detached where nothing in the body leads from the input, or the state, to the output.
  Slope slope(int input, int output) const override {
    const Value& made = inner->outputs[static_cast<std::size_t>(output)].value;
    const Value read = inner->reads(static_cast<std::size_t>(input));
    return Dependence(inner->graph, std::span(&read, 1))(made) ? Slope::Adjoint : Slope::Detached;
  }

  std::vector<Value> adjoint(const Node& node, std::span<const Value> gradients) const override {
    return adjoint_for(std::vector<bool>(node.inputs.size(), true), node, gradients);
  }

  /// Rays of pixels or samples beyond a last chunk that is not full are never written.
  void check_states_gradients(const std::vector<bool>& wanted) const {
    const auto behind_maps = wanted.begin() + static_cast<std::ptrdiff_t>(inner->inputs.size());
    const auto has_rays = [&](const Node& node) {
      return std::ranges::any_of(node.outputs, [&](const Signature& s) {
        return s.shape.h == domain.chunk_pixels && s.shape.w == domain.chunk_samples && s.shape.w > 1;
      });
    };
    const bool full = pixels() % domain.chunk_pixels == 0 && domain.samples % domain.chunk_samples == 0;
    if (!full && std::find(behind_maps, wanted.end(), true) != wanted.end() &&
        std::ranges::any_of(inner->graph.nodes(), has_rays))
      throw Error(ErrorKind::Failed, "a state has no gradient from rays of a last chunk that is not full", "map_chunks",
                  fmt::format("{} pixels, {} a chunk, {} samples, {} a chunk", pixels(), domain.chunk_pixels,
                              domain.samples, domain.chunk_samples),
                  "divisors of all pixels and of all samples");
  }

  /// Another map_chunks over the same domain: it runs the body again from the same seeds, and adds up what every chunk
  /// gives to the whole-map inputs and to states. Of the forward pass it is given what compile() finds worth keeping.
  std::vector<Value> adjoint_for(const std::vector<bool>& wanted, const Node& node,
                                 std::span<const Value> gradients) const override {
    Graph& graph = *node.graph;
    check_states_gradients(wanted);
    const std::size_t maps_count = inner->inputs.size();
    std::vector<Value> outer(node.inputs.begin(), node.inputs.begin() + static_cast<std::ptrdiff_t>(maps_count));
    std::vector<std::size_t> arrived;
    for (std::size_t o = 0; o < gradients.size(); ++o)
      if (gradients[o]) arrived.push_back(o), outer.push_back(gradients[o]);

    const auto reached = std::make_shared<std::vector<std::size_t>>();  // inputs and states that have a gradient
    const auto backward = [forward_body = build, forward_inner = inner, domain = domain, arrived, reached, maps_count,
                           wanted](Graph& g, std::span<const Value> in) {
      const std::span<const Value> maps = in.first(maps_count);
      const std::size_t before = g.nodes().size();
      const std::vector<ChunkOutput> forward = forward_body(g, maps);
      const std::size_t nodes = g.nodes().size() - before, first = forward_inner->graph.nodes().size() - maps_count;
      if (nodes != first)
        throw Error(ErrorKind::Failed, "a body is another when it is built again", "map_chunks",
                    fmt::format("{} nodes", nodes), fmt::format("{}", first));
      std::vector<Value> outputs, seeds;
      for (std::size_t i = 0; i < arrived.size(); ++i) {
        const ChunkOutput& o = forward[arrived[i]];
        const Value whole = in[maps_count + i];
        outputs.push_back(o.value);
        seeds.push_back(o.total ? whole : take_pixels(whole, domain.chunk_pixels));
      }
      std::vector<Value> reads(maps.begin(), maps.end()), wrt;
      for (const Value& s : forward_inner->states) reads.push_back(same_state(g, s));
      std::vector<std::size_t> which;
      for (std::size_t i = 0; i < reads.size(); ++i)
        if (wanted[i]) wrt.push_back(reads[i]), which.push_back(i);
      const std::vector<Value> found = gradient(outputs, seeds, wrt);
      std::vector<ChunkOutput> given;
      reached->clear();
      for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i]) given.push_back(gradient_output(found[i], domain)), reached->push_back(which[i]);
      return given;
    };
    std::vector<Value> result(node.inputs.size());
    const Beginning beginning{&node, static_cast<int>(arrived.size())};
    const Value first = make_map_chunks(graph, domain, outer, backward, beginning);
    for (std::size_t i = 0; i < reached->size(); ++i) result[(*reached)[i]] = first.node->value(static_cast<int>(i));
    return result;
  }
};

/// Runs the body once to learn what it reads. States that it uses become states of the outer graph, and inputs of the
/// node behind the whole maps.
Value make_map_chunks(Graph& graph, const ChunkDomain& domain, const std::vector<Value>& inputs, const BuildBody& build,
                      const Beginning& beginning) {
  const auto inner = std::make_shared<Inner>();
  for (std::size_t i = 0; i < inputs.size(); ++i)
    inner->inputs.push_back(inner->graph.input(Inner::input_name(i), inputs[i].shape(), inputs[i].type()));
  inner->outputs = build(inner->graph, inner->inputs);
  if (!inner->graph.updates().empty())
    throw Error(ErrorKind::Failed, "a body writes a state: chunks would see different ones", "map_chunks",
                inner->graph.updates()[0].node->op->name());
  std::vector<Value> outer = inputs;
  inner->states = inner->graph.states();
  for (const Value& s : inner->states) outer.push_back(same_state(graph, s));
  return graph.make<MapChunksOp>(std::move(outer), domain, build, inner, beginning);
}

}  // namespace

Value take_pixels(Value whole, int capacity) { return whole.graph().make<TakeOp>({whole}, capacity); }

Value put_pixels(Value columns, const Shape& whole) {
  if (columns.shape().c != whole.c || columns.shape().w != 1)
    throw Error(ErrorKind::Failed, "columns do not fit the map", "put_pixels", columns.shape().text(), whole.text());
  return columns.graph().make<PutOp>({columns}, whole);
}

std::vector<Value> map_chunks(Graph& graph, const ChunkDomain& domain, std::span<const Value> inputs,
                              const BuildBody& body) {
  if (domain.n < 1 || domain.height < 1 || domain.width < 1 || domain.samples < 1 || domain.chunk_pixels < 1 ||
      domain.chunk_samples < 1)
    throw Error(ErrorKind::Failed, "an empty domain", "map_chunks");
  const Value first = make_map_chunks(graph, domain, {inputs.begin(), inputs.end()}, body, {});
  std::vector<Value> outputs;
  for (std::size_t o = 0; o < first.node->outputs.size(); ++o)
    outputs.push_back(first.node->value(static_cast<int>(o)));
  return outputs;
}

}  // namespace clerestory
