// What an op is: a shape rule, an adjoint rule, a launch and a cost. Ops hold their attributes and nothing else; they
// are shared by every plan that contains them.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host/cl/device.hpp"
#include "host/graph/shape.hpp"

namespace clerestory {

struct Node;
class Graph;
class Executor;

/// One output of a node. Cheap to copy; a default-made one is "no value" (a gradient that does not exist).
struct Value {
  Node* node = nullptr;
  int output = 0;

  const Shape& shape() const;
  Type type() const;
  Graph& graph() const;
  explicit operator bool() const { return node != nullptr; }
  bool operator==(const Value&) const = default;
};

/// A tensor in device memory as a kernel sees it: IN(t)/OUT(t) of kernels/lib/real.clh take these three as arguments.
struct TensorView {
  Buffer buffer;
  std::uint64_t offset = 0;  // elements
  int stride = 0;            // elements between batch items
  Shape shape;
  Type type = Type::Real;

  /// The same, `elements` further on.
  TensorView from(std::uint64_t elements) const {
    TensorView view = *this;
    view.offset += elements;
    return view;
  }
};

/// The tile that a map_chunks body is working on: pixels [first_pixel, first_pixel + pixels) of n*h*w in row-major
/// order, samples [first_sample, first_sample + samples) of each. Outside of map_chunks all are zero.
struct Chunk {
  int first_pixel = 0, pixels = 0, first_sample = 0, samples = 0;
};

/// Told after every chunk of a map_chunks how many of them the device has finished. What it throws ends the run.
using ChunkListener = std::function<void(int done, int chunks)>;

/// Everything an op may use while it launches its kernels.
class Launch {
 public:
  Launch(Device device_, Precision precision_, std::string gemm_)
      : device(std::move(device_)), precision(precision_), gemm(std::move(gemm_)) {}

  Device device;
  Precision precision;
  std::string gemm;               // of gemm_choices(), but for "auto"
  bool small_nets_whole = false;  // PlanOptions
  std::uint32_t seed = 0;         // of this run and this node's draws; random ops mix in their own salt
  Chunk chunk;
  const ChunkListener* after_chunk = nullptr;  // null: nobody listens, and the device is not waited for
  Executor* body = nullptr;                    // runs the op's Body, if it has one
  std::vector<TensorView> inputs, outputs;
  TensorView workspace;  // of the size the op asked for

  const TensorView& in(int i) const { return inputs[static_cast<std::size_t>(i)]; }
  const TensorView& out(int i = 0) const { return outputs[static_cast<std::size_t>(i)]; }

  /// Runs kernel `name` of `file`; a TensorView argument becomes buffer, offset and stride, a list of them all of
  /// theirs, `Real` a float or double.
  template <class... Args>
  void run(std::string_view file, std::string_view name, const Range& range, const Args&... args) {
    run_with({}, file, name, range, args...);
  }
  template <class... Args>
  void run_with(const Defines& defines, std::string_view file, std::string_view name, const Range& range,
                const Args&... args) {
    std::vector<Arg> list;
    list.reserve(3 * sizeof...(args));
    (push(list, args), ...);
    device.launch_with(device.kernel(file, name, defines, precision), range, list);
  }

  /// A real number as a kernel argument.
  struct Real {
    double value;
  };

 private:
  void push(std::vector<Arg>& list, const TensorView& t) const {
    list.emplace_back(t.buffer), list.emplace_back(t.offset), list.emplace_back(t.stride);
  }
  void push(std::vector<Arg>& list, const std::vector<TensorView>& tensors) const {
    for (const TensorView& t : tensors) push(list, t);
  }
  void push(std::vector<Arg>& list, const Real& r) const {
    if (precision == Precision::Double)
      list.emplace_back(r.value);
    else
      list.emplace_back(static_cast<float>(r.value));
  }
  template <class T>
  void push(std::vector<Arg>& list, const T& value) const {
    list.emplace_back(value);
  }
};

struct Cost {
  double flops = 0, bytes = 0;
};

/// A subgraph that launch() runs, `times` times, on the executor that it is lent (Launch::body). Plans compile it with
/// their own options for their own device, and count what it does and needs.
struct Body {
  const Graph* graph = nullptr;  // null: the op runs none
  std::vector<Value> outputs;
  int times = 0;
  std::vector<Value> given{};  // are not computed: launch() binds them, as the executor's inputs of given_name()

  static std::string given_name(std::size_t i) { return fmt::format("given{}", i); }
};

/// How the gradient of an output goes to an input.
enum class Slope {
  Adjoint,   // by the op's rule
  Detached,  // not at all, by definition: the input is not read, or it only chooses what is looked at
  None       // it might, but the op has no rule for it: to ask for it is an error
};

class Op {
 public:
  virtual ~Op() = default;

  /// Its own, for profiles and messages: often the stem of its files, kernels/nn/pool.cl, host/ops/nn/pool.cpp.
  virtual std::string name() const = 0;
  /// Shapes and types of the outputs; throws Error when the inputs do not fit, naming both shapes.
  virtual std::vector<Signature> infer(std::span<const Value> inputs) const = 0;
  /// What there is between an input and an output. Ops with an adjoint for some of them alone say so.
  virtual Slope slope(int, int) const { return Slope::Adjoint; }
  /// Gradients with respect to each input from those of each output (absent ones are empty Values); empty where no
  /// slope of the input is Adjoint. Every op has a rule, or is NotDifferentiable.
  virtual std::vector<Value> adjoint(const Node& node, std::span<const Value> gradients) const = 0;
  /// The same for the inputs that somebody wants; what others get is not looked at.
  virtual std::vector<Value> adjoint_for(const std::vector<bool>&, const Node& node,
                                         std::span<const Value> gradients) const {
    return adjoint(node, gradients);
  }
  /// Launches the kernels. Every kernel honours the batch strides of its tensors.
  virtual void launch(Launch& launch) const = 0;

  virtual Cost cost(const Node& node) const;                      // default: bytes of inputs and outputs
  virtual std::size_t workspace(const Node&) const { return 0; }  // elements of the plan's real type
  /// Input whose memory output 0 may take when nobody needs that input afterwards; -1: none.
  virtual int overwrites() const { return -1; }
  /// Elements from the start of input 0 at which output 0 lies when the op is a view; -1: it is not a view. A view also
  /// has a launch(), used when memory does not allow the view.
  virtual long view_offset(const Node&) const { return -1; }
  /// True when inputs may be written straight to their place in output 0 (concatenation along channels).
  virtual bool gathers_inputs() const { return false; }
  /// Inputs, all of them states, that launch() writes: such a node is an update, runs once, and after all who read them
  /// as they were. Other nodes may run again where memory is short: launch() has no effect but on its outputs.
  virtual std::vector<int> writes() const { return {}; }
  virtual Body body() const { return {}; }
};

/// An op through which no gradient goes: gradient() refuses to be asked for one, by the op's name.
struct NotDifferentiable : Op {
  Slope slope(int, int) const override { return Slope::None; }
  std::vector<Value> adjoint(const Node&, std::span<const Value>) const final;
};

}  // namespace clerestory
