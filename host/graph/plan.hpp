// compile() turns a graph into a plan: which nodes run, in which order, and where every value lives in one arena.
// An Executor owns the memory of a plan and runs it on one in-order queue.
#pragma once
#include <string>
#include <vector>

#include "host/graph/graph.hpp"

namespace clerestory {

struct PlanOptions {
  Precision precision = Precision::Single;
  /// One of gemm_choices(). auto: what Device::use_gemm() chose; if that is auto too, what was measured faster on the
  /// device (host/tuning/tuning.hpp).
  std::string gemm = "auto";
  bool small_nets_whole = false;  // one kernel each under CLBlast too; compile() says so where it was not asked for
  bool prune = true;              // leave out nodes that no output needs
  bool alias = true;              // views, in-place ops and concatenations without copies
  bool reuse = true;              // values whose lives do not overlap share memory
  bool reorder = true;            // steps run in the order that needs least memory, of a few
  /// Most bytes of device memory that Plan::memory() may come to; 0: no such limit. To keep to it, values are computed
  /// again instead of being kept.
  std::size_t budget = 0;
  std::string budget_name = "memory";  // what its user calls it, for errors
  /// Most bytes of what chunks found that are kept for their adjoint, all together, where no budget is set; what does
  /// not fit is computed again, with the same bits. 0: all of it.
  std::size_t keep = std::size_t{64} << 20;
};

/// The states of a model on one device: parameters, moments, running statistics. Shared by plans (training,
/// validation).
class States {
 public:
  States(Device device, Precision precision = Precision::Single);

  /// Makes every state of the graph that does not exist yet, from its Init and the seed.
  void initialise(const Graph& graph, std::uint64_t seed);
  bool has(const std::string& name) const;
  Tensor get(const std::string& name) const;
  void set(const std::string& name, const Tensor& tensor);  // throws when the shape differs
  /// Throws Error when the state that is kept under that name has another shape.
  void check_shape(const StateOp& state) const;
  std::vector<std::string> names() const;  // sorted
  TensorView view(const std::string& name) const;
  Precision precision() const { return precision_; }

 private:
  friend class Executor;
  friend std::shared_ptr<States> in_precision(const std::shared_ptr<States>& states, Precision precision);
  mutable Device device_;
  Precision precision_;
  std::map<std::string, TensorView> states_;
};

/// Where a value lives.
struct Placement {
  enum class Where { Arena, Input, State, Constant } where = Where::Arena;
  int slot = 0;              // arena: root; otherwise index into the plan's list
  std::uint64_t offset = 0;  // elements, inside the root
  int stride = 0;            // elements between batch items
};

struct Plan;

struct Step {
  const Node* node = nullptr;
  std::vector<Placement> inputs, outputs;
  Placement workspace;
  std::shared_ptr<const Plan> body;  // of the op's Body, if it has one
  int times = 1;                     // that it runs
};

/// What the steps of one op do in a run, those of bodies included.
struct Work {
  long steps = 0;  // each launches one or a few kernels
  Cost cost;
  double seconds = 0;  // 0 when nobody measured
};

/// Bytes of device memory that a plan needs, all there at once.
struct PlanMemory {
  std::size_t values = 0;  // the arena, of which at most `alive` is needed at once, in step `fullest`
  std::size_t alive = 0;
  std::string fullest;
  std::size_t bodies = 0;  // arenas and constants of bodies
  std::size_t constants = 0, inputs = 0, states = 0;

  std::size_t total() const { return values + bodies + constants + inputs + states; }
};

struct Plan {
  const Graph* graph = nullptr;
  Device device;
  PlanOptions options;
  std::vector<Step> steps;
  std::vector<const Node*> input_nodes, state_nodes, constant_nodes;
  std::vector<Value> outputs;
  std::vector<Placement> output_places;
  std::vector<std::size_t> roots;  // byte offset of each root in the arena
  std::size_t arena_bytes = 0, alive_bytes = 0;
  std::string fullest;             // op of the step at which `alive_bytes` are needed
  std::vector<std::string> notes;  // what each pass did
  std::shared_ptr<std::deque<Node>> made = std::make_shared<std::deque<Node>>();  // nodes of steps that are no graph's
  /// What a run needs, as compile() knows it: what an Executor and the states will have allocated, to the byte, where
  /// every input is fed and none is bound.
  PlanMemory memory() const;
  std::size_t memory_as_body() const;  // the same where inputs and states are the outer plan's
};

/// A plan that computes `outputs` and, when `updates` is true, every state update of the graph. Throws Error of kind
/// Usage where the budget cannot be met, with the least that was found.
Plan compile(const Graph& graph, std::vector<Value> outputs, Device device, const PlanOptions& options = {},
             bool updates = false);

class Executor {
 public:
  /// `states` may be null when the graph has none; it is shared, not copied.
  Executor(Plan plan, std::shared_ptr<States> states = nullptr);

  void feed(const std::string& input, const Tensor& tensor);  // kept until fed again
  void feed(const std::string& input, std::span<const float> data);
  void bind(const std::string& input, const TensorView& memory);  // uses memory of somebody else
  void run(std::uint32_t seed = 0, const Chunk& chunk = {});
  void after_chunk(ChunkListener listener) { after_chunk_ = std::move(listener); }  // of the runs to come
  Tensor fetch(Value output);  // one of the plan's outputs, after run()
  std::vector<float> fetch_floats(Value output);
  TensorView view(Value output) const;

  const Plan& plan() const { return plan_; }
  std::size_t bytes() const;  // arenas, constants and inputs that were fed; not what was bound
  /// On a CPU, the most that this process will hold: what it held before this was made, and what the plan needs beside
  /// the states, which are there. 0 elsewhere. What the driver takes to load and build kernels comes on top.
  std::size_t predicted_process() const;
  /// By op. With `profile`, of one profiled run.
  std::map<std::string, Work> work(bool profile = false);
  /// The same as a table, and what each pass did, and memory. A body's chunks count as full ones, for that is what most
  /// of its ops work on.
  std::string explain(bool profile = false);

 private:
  std::string explain_memory() const;
  void allocate_input(std::size_t index);
  void add_work(std::map<std::string, Work>& rows, int times) const;
  void set_profiling(bool on);
  double profiled_seconds() const;
  TensorView resolve(const Placement& place, const Shape& shape, Type type) const;
  Plan plan_;
  std::shared_ptr<States> states_;
  Buffer arena_;
  std::vector<TensorView> inputs_, constants_;
  std::vector<bool> owns_;                         // of the inputs; others are bound, or not fed yet
  std::vector<std::unique_ptr<Executor>> bodies_;  // one per step, null for most
  std::vector<double> seconds_;                    // of each step without its body, while profiling; else empty
  std::size_t fed_bytes_ = 0;
  std::size_t resident_before_ = 0;  // bytes of this process
  ChunkListener after_chunk_;
};

/// Compiles and runs at once: the values of `outputs` for the given inputs. For tests and small jobs.
std::vector<Tensor> evaluate(const Graph& graph, std::vector<Value> outputs, Device device,
                             const std::map<std::string, Tensor>& feeds, const PlanOptions& options = {},
                             std::uint32_t seed = 0, std::shared_ptr<States> states = nullptr);

}  // namespace clerestory
