// compile() turns a graph into a plan: which nodes run, in which order, and where every value lives in one arena.
// An Executor owns the memory of a plan and runs it on one in-order queue.
#pragma once
#include <string>
#include <vector>

#include "host/graph/graph.hpp"

namespace clerestory {

struct PlanOptions {
  Precision precision = Precision::Single;
  /// packed | clblast | auto: what Device::use_gemm() chose. If that is auto too, convolutions and products are packed
  /// on a CPU and CLBlast's elsewhere, and small nets are one kernel; under clblast those multiply by it as well.
  std::string gemm = "auto";
  bool prune = true;  // leave out nodes that no output needs
  bool alias = true;  // views, in-place ops and concatenations without copies
  bool reuse = true;  // values whose lives do not overlap share memory
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
  void bind(const std::string& name, const TensorView& memory) { states_[name] = memory; }  // memory of somebody else
  std::vector<std::string> names() const;                                                   // sorted
  TensorView view(const std::string& name) const;
  Precision precision() const { return precision_; }

 private:
  friend class Executor;
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

struct Plan {
  const Graph* graph = nullptr;
  Device device;
  PlanOptions options;
  std::vector<Step> steps;
  std::vector<const Node*> input_nodes, state_nodes, constant_nodes;
  std::vector<Value> outputs;
  std::vector<Placement> output_places;
  std::vector<std::size_t> roots;  // byte offset of each root in the arena
  std::size_t arena_bytes = 0;
  std::vector<std::string> notes;  // what each pass did
  /// The arenas of this plan and of its bodies: what a run needs beside inputs, constants and states.
  std::size_t memory() const;
};

/// A plan that computes `outputs` and, when `updates` is true, every state update of the graph.
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
  /// By op. With `profile`, of one profiled run.
  std::map<std::string, Work> work(bool profile = false);
  /// The same as a table, and what each pass did. A body's chunks count as full ones, for that is what most of its ops
  /// work on.
  std::string explain(bool profile = false);

 private:
  void allocate_input(std::size_t index);
  void add_work(std::map<std::string, Work>& rows, int times) const;
  void set_profiling(bool on);
  double profiled_seconds() const;
  TensorView resolve(const Placement& place, const Shape& shape, Type type) const;
  Plan plan_;
  std::shared_ptr<States> states_;
  Buffer arena_;
  std::vector<TensorView> inputs_, constants_;
  std::vector<std::unique_ptr<Executor>> bodies_;  // one per step, null for most
  std::vector<double> seconds_;                    // of each step without its body, while profiling; else empty
  std::size_t fed_bytes_ = 0;
  ChunkListener after_chunk_;
};

/// Compiles and runs at once: the values of `outputs` for the given inputs. For tests and small jobs.
std::vector<Tensor> evaluate(const Graph& graph, std::vector<Value> outputs, Device device,
                             const std::map<std::string, Tensor>& feeds, const PlanOptions& options = {},
                             std::uint32_t seed = 0, std::shared_ptr<States> states = nullptr);

}  // namespace clerestory
