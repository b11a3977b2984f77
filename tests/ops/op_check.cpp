#include "tests/ops/op_check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdlib>
#include <random>
#include <set>

#include "host/cl/tile.hpp"
#include "host/ops/tensor/concat.hpp"
#include "host/ops/tensor/slice.hpp"

namespace clerestory {
namespace {

constexpr double kCanary = 12345.5;  // exact in float

double epsilon(Precision p) { return p == Precision::Single ? FLT_EPSILON : DBL_EPSILON; }
const char* text(Precision p) { return p == Precision::Single ? "float" : "double"; }

double largest(const Tensor& t) {
  double m = 0;
  for (const double x : t.real) m = std::max(m, std::abs(x));
  return m;
}

Tensor rounded_to_float(Tensor t) {
  for (double& x : t.real) x = static_cast<float>(x);
  return t;
}

/// A graph of the case, with its inputs as they are or as slices of bigger tensors, and its plan on a device.
class Run {
 public:
  Run(const OpCase& c, Precision precision, PlanOptions options = {}, bool wrap = false, bool with_gradients = false)
      : case_(c), precision_(precision), wrap_(wrap) {
    Values values;
    for (const auto& [name, tensor] : c.inputs) values[name] = input(name, tensor);
    outputs_ = c.build(graph_, values);
    for (const auto& [name, tensor] : c.states) values[name] = graph_.state(name, tensor.shape, Init::fixed(0));
    if (with_gradients) add_gradients(values);
    if (wrap) wrap_outputs();
    const Device device = test_device(precision);
    if (!graph_.states().empty()) {
      states_ = std::make_shared<States>(device, precision);
      states_->initialise(graph_, c.seed);
    }
    options.precision = precision;
    executor_ = std::make_unique<Executor>(compile(graph_, outputs_, device, options, true), states_);
    for (const auto& [name, tensor] : c.inputs) feed(name, tensor);
  }

  void feed(const std::string& name, const Tensor& tensor) {
    if (case_.states.count(name)) return states_->set(name, tensor);
    if (wrap_ && tensor.type() == Type::Real)
      executor_->feed(name, padded(tensor));
    else
      executor_->feed(name, tensor);
  }

  /// Outputs in order, then states by name.
  std::vector<Tensor> operator()() {
    for (const auto& [name, tensor] : case_.states) states_->set(name, moved_.count(name) ? moved_[name] : tensor);
    executor_->run(case_.seed);
    std::vector<Tensor> results;
    for (const Value& v : outputs_) results.push_back(unwrapped(executor_->fetch(v)));
    if (!graph_.updates().empty())
      for (const auto& [name, tensor] : case_.states) results.push_back(states_->get(name));
    return results;
  }

  void move(const std::string& name, const Tensor& tensor) {
    if (case_.states.count(name))
      moved_[name] = tensor;
    else
      feed(name, tensor);
  }

  const std::vector<Value>& outputs() const { return outputs_; }
  const std::vector<Tensor>& cotangents() const { return cotangents_; }

 private:
  Value input(const std::string& name, const Tensor& tensor) {
    if (!wrap_ || tensor.type() == Type::Int) return graph_.input(name, tensor.shape, tensor.type());
    Shape bigger = tensor.shape;
    bigger.c += 2;
    return slice(graph_.input(name, bigger), 1, tensor.shape.c);
  }

  static Tensor padded(const Tensor& t) {
    Shape bigger = t.shape;
    bigger.c += 2;
    Tensor out(bigger, kCanary);
    for (int n = 0; n < t.shape.n; ++n)
      std::copy_n(t.real.begin() + n * t.shape.item(), t.shape.item(),
                  out.real.begin() + n * bigger.item() + bigger.plane());
    return out;
  }

  void wrap_outputs() {
    for (Value& v : outputs_) {
      if (v.type() == Type::Int) continue;
      const Shape& s = v.shape();
      const Value canary = graph_.fill({s.n, 1, s.h, s.w}, kCanary);
      const std::vector<Value> parts{canary, v, canary};
      v = concat(parts);
    }
  }

  Tensor unwrapped(Tensor t) const {
    if (!wrap_ || t.type() == Type::Int) return t;
    Shape s = t.shape;
    s.c -= 2;
    Tensor inner(s);
    for (int n = 0; n < s.n; ++n) {
      const auto begin = t.real.begin() + n * t.shape.item();
      for (long i = 0; i < s.plane(); ++i) {
        EXPECT_EQ(begin[i], kCanary) << case_.label << ": written before the output, item " << n << ", element " << i;
        EXPECT_EQ(begin[i + s.plane() + s.item()], kCanary) << case_.label << ": written behind the output, item " << n;
      }
      std::copy_n(begin + s.plane(), s.item(), inner.real.begin() + n * s.item());
    }
    return inner;
  }

  /// Appends the gradients of sum(outputs * cotangents); the cotangents are constants.
  void add_gradients(const Values& values) {
    std::vector<Value> from, seeds, wrt;
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      cotangents_.push_back(
          outputs_[i].type() == Type::Real ? rounded_to_float(random_tensor(outputs_[i].shape(), 77 + i)) : Tensor());
      if (outputs_[i].type() == Type::Int) continue;
      from.push_back(outputs_[i]), seeds.push_back(graph_.constant(cotangents_.back()));
    }
    for (const std::string& name : case_.differentiate) wrt.push_back(values.at(name));
    for (std::size_t i = 0; const Value& g : gradient(from, seeds, wrt)) {
      ASSERT_TRUE(g) << case_.label << ": no gradient reaches " << case_.differentiate[i];
      outputs_.push_back(g), ++i;
    }
  }

  const OpCase& case_;
  Precision precision_;
  bool wrap_;
  Graph graph_;
  std::vector<Value> outputs_;
  std::vector<Tensor> cotangents_;
  Tensors moved_;
  std::shared_ptr<States> states_;
  std::unique_ptr<Executor> executor_;
};

void expect_close(const Tensor& got, const Tensor& want, double tolerance, const std::string& what) {
  ASSERT_EQ(got.shape.text(), want.shape.text()) << what;
  if (want.type() == Type::Int) {
    EXPECT_EQ(got.integer, want.integer) << what;
    return;
  }
  ASSERT_EQ(got.real.size(), want.real.size()) << what;
  double worst = -1;
  std::size_t at = 0;
  for (std::size_t i = 0; i < want.real.size(); ++i) {
    if (got.real[i] == want.real[i]) continue;  // also equal infinities
    const double error = std::abs(got.real[i] - want.real[i]);
    if (!(error <= worst)) worst = error, at = i;  // a NaN is the worst
    if (std::isnan(error)) break;
  }
  if (worst == -1) return;
  EXPECT_LE(worst, tolerance) << what << ", element " << at << " of " << want.shape.text() << ": " << got.real[at]
                              << " instead of " << want.real[at];
}

void expect_same_bits(const std::vector<Tensor>& a, const std::vector<Tensor>& b, const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].integer, b[i].integer) << what << ", output " << i;
    long differ = 0;
    for (std::size_t k = 0; k < a[i].real.size(); ++k)
      differ += !(a[i].real[k] == b[i].real[k] || (std::isnan(a[i].real[k]) && std::isnan(b[i].real[k])));
    EXPECT_EQ(differ, 0) << what << ", output " << i << " of " << a[i].shape.text() << ": elements that differ";
  }
}

double weighted_sum(const std::vector<Tensor>& outputs, const std::vector<Tensor>& cotangents) {
  long double sum = 0;
  for (std::size_t o = 0; o < cotangents.size(); ++o)
    for (std::size_t i = 0; i < cotangents[o].real.size(); ++i)
      sum += static_cast<long double>(outputs[o].real[i]) * cotangents[o].real[i];
  return static_cast<double>(sum);
}

void check_differences(const OpCase& c, const std::vector<Tensor>& gradients, const std::vector<Tensor>& cotangents) {
  Run run(c, Precision::Double);
  for (std::size_t d = 0; d < c.differentiate.size(); ++d) {
    const std::string& name = c.differentiate[d];
    const Tensor base = c.inputs.count(name) ? c.inputs.at(name) : c.states.at(name);
    const Tensor& adjoint = gradients[d];
    const double scale = std::max(largest(adjoint), 1e-30);
    const std::size_t count = base.real.size();
    std::mt19937_64 random(d + 1);
    const std::size_t moves = std::min(count, static_cast<std::size_t>(c.differences));
    double worst = 0;
    std::string at;
    for (std::size_t m = 0; m < moves; ++m) {
      const std::size_t i = moves == count ? m : random() % count;
      double sides[2];
      for (const int side : {0, 1}) {
        Tensor moved = base;
        moved.real[i] += side ? c.step : -c.step;
        run.move(name, moved);
        sides[side] = weighted_sum(run(), cotangents);
      }
      const double difference = (sides[1] - sides[0]) / (2 * c.step);
      const double error = std::abs(difference - adjoint.real[i]) / scale;
      if (!(error <= worst))
        worst = error, at = fmt::format("element {}: adjoint {}, difference {}", i, adjoint.real[i], difference);
    }
    run.move(name, base);
    EXPECT_LE(worst, c.gradient_tolerance) << c.stem << "/" << c.label << ": gradient of " << name << ", " << at;
    EXPECT_GT(moves, 0u) << name << " has no elements";
  }
}

/// Outputs {which, element} that differ between two runs, or are NaN.
using Places = std::set<std::pair<std::size_t, std::size_t>>;
template <class Is>
Places places(const std::vector<Tensor>& outputs, Is is) {
  Places found;
  for (std::size_t o = 0; o < outputs.size(); ++o)
    for (std::size_t i = 0; i < outputs[o].real.size(); ++i)
      if (is(o, i)) found.emplace(o, i);
  return found;
}

/// What is no number must not be taken for one: a maximum or a clamp that drops it hides that a net has failed.
void check_nan(const OpCase& c) {
  Run run(c, Precision::Single);
  const std::vector<Tensor> base = run();
  Tensors moving = c.inputs;
  moving.insert(c.states.begin(), c.states.end());
  for (const auto& [name, tensor] : moving) {
    const double step = 2 * largest(tensor) + 1;
    for (std::size_t k = 0; k < std::min<std::size_t>(tensor.real.size(), 4); ++k) {
      const std::size_t i = (2 * k + 1) * tensor.real.size() / 8;  // a few, spread
      const auto with = [&](double value) {
        Tensor moved = tensor;
        moved.real[i] = value;
        run.move(name, moved);
        return run();
      };
      const std::vector<Tensor> high = with(tensor.real[i] + step), low = with(tensor.real[i] - step), none = with(NAN);
      const auto is_nan = [&](std::size_t o, std::size_t at) { return std::isnan(none[o].real[at]); };
      const Places hidden = places(base, [&](std::size_t o, std::size_t at) {
        const double value = base[o].real[at];
        return (high[o].real[at] != value || low[o].real[at] != value) && !is_nan(o, at);
      });
      if (hidden.empty()) continue;
      const auto [o, at] = *hidden.begin();
      ADD_FAILURE() << c.stem << "/" << c.label << " hides a NaN in element " << i << " of " << name << ": output " << o
                    << ", element " << at << " is " << none[o].real[at];
    }
    run.move(name, tensor);
  }
}

std::set<std::string> launched(Precision precision) {
  std::set<std::string> names;
  for (const KernelProfile& k : test_device(precision).profile())
    names.insert(k.kernel.substr(k.kernel.find_last_of(":/") + 1));
  return names;
}

std::vector<OpCase>& cases() {
  static std::vector<OpCase> all;
  return all;
}

/// `group`: work-items that share a row (host/ops/tensor/rows.hpp), 0 for what suits the device.
class OpTest : public testing::Test {
 public:
  OpTest(std::size_t index, int group) : index_(index), group_(group) {}
  void TestBody() override {
    if (group_) setenv("CLERESTORY_GROUP", std::to_string(group_).c_str(), 1);
    check_op(declared_cases()[index_]);
    if (group_) unsetenv("CLERESTORY_GROUP");
  }

 private:
  std::size_t index_;
  int group_;
};

bool lies_in(const std::string& room, const std::string& stem) {
  return std::ranges::count(kernel_files(), room + "/" + stem + ".cl") > 0;
}

/// True when the kernels of this stem have one body for CPUs and one for groups of work-items (kernels/lib/lanes.clh).
bool walks_rows(const std::string& stem) {
  for (const std::string& file : kernel_files())
    if (file.ends_with("/" + stem + ".cl") && kernel_source(file).find("define GROUP_SCRATCH") != std::string::npos)
      return true;
  return false;
}

/// True when a kernel of the case multiplies in the register tile of kernels/lib/tile.clh, on a CPU.
bool multiplies_in_tiles(const OpCase& c) {
  static const std::set<std::string> kernels{"conv_cpu", "conv_weights_cpu", "ask_mlp", "ask_field"};
  return std::ranges::any_of(c.kernels, [&](const std::string& kernel) { return kernels.count(kernel) > 0; });
}

/// Every tile gives the bits of the device's own, which check_op compares with the reference and with differences, and
/// writes nothing beside its output.
void check_tiles(const OpCase& declared) {
  OpCase c = declared;
  for (auto& [name, tensor] : c.inputs) tensor = rounded_to_float(tensor);
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    const auto run_in = [&](const std::string& tile) {
      test_device(precision).use_tile(tile);
      std::vector<Tensor> values = Run(c, precision, {}, false, !c.differentiate.empty())();
      for (Tensor& t : Run(c, precision, {}, true)()) values.push_back(std::move(t));
      test_device(precision).use_tile("auto");
      return values;
    };
    const std::vector<Tensor> own = run_in("auto");
    for (const Tile& tile : tiles())
      expect_same_bits(run_in(tile.name), own,
                       fmt::format("{}/{} in {}, tile {}", c.stem, c.label, text(precision), tile.name));
  }
}

class TileTest : public testing::Test {
 public:
  explicit TileTest(std::size_t index) : index_(index) {}
  void TestBody() override { check_tiles(declared_cases()[index_]); }

 private:
  std::size_t index_;
};

}  // namespace

Device test_device(Precision precision) {
  static Device single = Device::open();
  static Device with_doubles = [] {
    if (single.has_double()) return single;
    for (const DeviceInfo& info : list_devices())
      if (info.fp64) return Device::open(std::to_string(info.index));
    throw Error(ErrorKind::Device, "no device here has doubles: the reference twins cannot run", "tests");
  }();
  return precision == Precision::Single ? single : with_doubles;
}

Tensor random_tensor(Shape shape, std::uint64_t seed, double low, double high) {
  std::mt19937_64 random(seed * 7919 + 13);
  Tensor t(shape);
  for (double& x : t.real) x = low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
  return t;
}

Tensor random_ints(Shape shape, std::uint64_t seed, int low, int high) {
  std::mt19937_64 random(seed * 7919 + 17);
  std::vector<int> values(static_cast<std::size_t>(shape.count()));
  for (int& x : values) x = low + static_cast<int>(random() % static_cast<std::uint64_t>(high - low));
  return Tensor::of_int(shape, std::move(values));
}

const std::vector<OpCase>& declared_cases() { return cases(); }

bool declare_cases(std::vector<OpCase> added) {
  for (OpCase& c : added) {
    const std::size_t index = cases().size();
    const std::string name = c.stem + "/" + c.label;
    cases().push_back(std::move(c));
    // The bodies that GPUs run are tested on every device; cases have rows shorter and longer than this group.
    for (const int group : {0, 16})
      if (group == 0 || walks_rows(cases().back().stem))
        testing::RegisterTest(group ? "OpInGroups" : "Op", name.c_str(), nullptr, nullptr, __FILE__, __LINE__,
                              [index, group]() -> testing::Test* { return new OpTest(index, group); });
    if (multiplies_in_tiles(cases().back()))
      testing::RegisterTest("OpInTiles", name.c_str(), nullptr, nullptr, __FILE__, __LINE__,
                            [index]() -> testing::Test* { return new TileTest(index); });
  }
  return true;
}

void check_op(const OpCase& declared) {
  OpCase c = declared;
  for (auto& [name, tensor] : c.inputs) tensor = rounded_to_float(tensor);
  for (auto& [name, tensor] : c.states) tensor = rounded_to_float(tensor);
  Tensors all = c.inputs;
  all.insert(c.states.begin(), c.states.end());
  const std::string name = c.stem + "/" + c.label;
  const std::vector<Tensor> want = c.reference(all);
  const bool gradients = !c.differentiate.empty();
  const double gradient_roundings = c.gradient_roundings > 0 ? c.gradient_roundings : 4 * c.roundings;

  std::map<Precision, std::vector<Tensor>> values;  // outputs, gradients, states
  std::vector<Tensor> cotangents;
  std::size_t outputs = 0;
  for (const Precision precision : {Precision::Single, Precision::Double}) {
    Device device = test_device(precision);
    device.set_profiling(true);
    device.reset_profile();
    Run run(c, precision, {}, false, gradients);
    if (testing::Test::HasFatalFailure()) return;
    outputs = run.outputs().size() - c.differentiate.size();
    cotangents = run.cotangents();
    values[precision] = run();
    const std::vector<Tensor>& got = values[precision];
    expect_same_bits(run(), got, fmt::format("{} in {}, second run", name, text(precision)));

    // With every pass off, views and concatenations are copied by their kernels.
    Run plain(c, precision, {.prune = false, .alias = false, .reuse = false}, false, gradients);
    expect_same_bits(plain(), got, fmt::format("{} in {}, passes off", name, text(precision)));
    const std::set<std::string> seen = launched(precision);
    for (const std::string& kernel : c.kernels)
      EXPECT_TRUE(seen.count(kernel)) << name << " in " << text(precision) << " did not launch " << kernel;
    device.set_profiling(false);

    Run wrapped(c, precision, {}, true);
    std::vector<Tensor> inside = wrapped();
    std::vector<Tensor> beside = got;
    beside.erase(beside.begin() + static_cast<long>(outputs),
                 beside.begin() + static_cast<long>(outputs + c.differentiate.size()));
    expect_same_bits(inside, beside, fmt::format("{} in {}, as slices of bigger tensors", name, text(precision)));

    ASSERT_EQ(beside.size(), want.size()) << name << ": the reference gives another number of tensors";
    for (std::size_t i = 0; i < want.size(); ++i) {
      const double magnitude = c.magnitude > 0 ? c.magnitude : std::max(largest(want[i]), 1e-30);
      expect_close(beside[i], want[i], c.roundings * epsilon(precision) * magnitude,
                   fmt::format("{} in {} against the reference, output {}", name, text(precision), i));
    }
  }
  const std::vector<Tensor>&single = values[Precision::Single], &twin = values[Precision::Double];
  for (std::size_t i = 0; i < single.size(); ++i) {
    const bool is_gradient = i >= outputs && i < outputs + c.differentiate.size();
    const double magnitude = !is_gradient && c.magnitude > 0 ? c.magnitude : std::max(largest(twin[i]), 1e-30);
    expect_close(single[i], twin[i], (is_gradient ? gradient_roundings : c.roundings) * FLT_EPSILON * magnitude,
                 fmt::format("{}, float against double, {} {}", name, is_gradient ? "gradient" : "output",
                             is_gradient ? i - outputs : i));
  }
  if (lies_in("nn", c.stem) || lies_in("tensor", c.stem)) check_nan(c);
  if (gradients)
    check_differences(
        c,
        {twin.begin() + static_cast<long>(outputs), twin.begin() + static_cast<long>(outputs + c.differentiate.size())},
        cotangents);
}

}  // namespace clerestory
