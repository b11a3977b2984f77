// The backends of convolutions and matrix products, packed and CLBlast: a small MGNet infers and trains with either to
// the same result within rounding. Both are measured against the same plan in double.
//
// What rounding may do. A sum of K products in float rounds K times, by u / sqrt(3) of a partial sum in the mean square
// (u = epsilon / 2), and partial sums have half the mean square of the whole: an error as if every factor had moved by
// u sqrt(K / 6) up or down (the backward error of Higham 2002, section 3.1, on average). So the plan in double is run
// again with weights so moved, and with scales and offsets of normalisations moved by epsilon, for the few roundings of
// their own: results move as far as rounding moves them, however much the layers behind amplify that. The farthest of
// several such runs times kMargin bounds the error of either backend; the margin is for what moved weights leave out:
// every sum rounds anew, backwards too, and the worst of many elements lies some deviations out. Half precision, a lost
// tap or a stale buffer are off by a thousand times as much.
#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "nets/mgnet_training.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

using Results = std::map<std::string, std::vector<double>>;

// Sizes that are no whole number of lanes, and groups of two channels: with one, a bias before a group normalisation
// has a gradient of exactly zero, and float's is nothing but rounding.
constexpr int kBatch = 2, kHeight = 34, kWidth = 50, kSteps = 5, kMovedRuns = 3;
constexpr double kMargin = 8, kRate = 2e-3;
const MgnetSize kNet{DensenetSize{.growth = 4, .first = 16, .layers = {1, 2, 1, 1}}, DecoderSize{64, 32, 32, 16, 8}};

/// How a plan is run. `moved` numbers a choice of signs by which weights are moved; 0: not moved.
struct Setting {
  std::string gemm;
  Precision precision = Precision::Single;
  int moved = 0;
};
const Setting kPacked{"packed"}, kClblast{"clblast"}, kTwin{"packed", Precision::Double};

const std::string& name_of(const Value& state) { return static_cast<const StateOp&>(*state.node->op).state_name; }

Tensor starting_value(const Value& state, int moved) {
  const std::string& name = name_of(state);
  Tensor t = golden_weight(name, state.shape());
  if (name.find("running_") != std::string::npos || name.starts_with("adam.")) return t;
  // Few of ReLU's inputs are left near its kink: there, a rounding turns a gradient on or off.
  const double offset = name.find("norm") != std::string::npos && name.ends_with("bias") ? 1.5 : 0;
  for (double& w : t.real) w = static_cast<float>(w + offset);
  if (moved == 0) return t;
  const bool of_products = state.shape().n > 1 || name.starts_with("scale.weight");
  const double roundings = of_products ? std::sqrt(static_cast<double>(state.shape().item()) / 6) / 2 : 1;
  const Tensor sign = formula(fmt::format("moved {} {}", moved, name), state.shape());
  for (std::size_t i = 0; i < t.real.size(); ++i)
    t.real[i] *= 1 + (sign.real[i] < 0 ? -1 : 1) * roundings * FLT_EPSILON;
  return t;
}

std::shared_ptr<States> starting_states(const Graph& graph, const Device& device, const Setting& setting) {
  auto states = std::make_shared<States>(device, setting.precision);
  for (const Value& v : graph.states()) states->set(name_of(v), starting_value(v, setting.moved));
  return states;
}

std::map<std::string, Tensor> batch() {
  std::map<std::string, Tensor> feeds = golden_maps(kBatch, kHeight, kWidth);
  feeds["log_scale"] = Tensor({kBatch, 1, 1, 1}, 1.25), feeds["scale_mask"] = Tensor({kBatch, 1, 1, 1}, 1);
  feeds["learning_rate"] = Tensor({}, kRate);
  return feeds;
}

/// The plan's device, which lists the kernels that it runs from now on.
Device profiled_device(const Setting& setting) {
  Device device = device_for(setting.precision);
  device.set_profiling(true), device.reset_profile();
  return device;
}

/// Both backends end in equal results when one of them runs for both; so each is seen to run.
void expect_kernels_of(const Setting& setting, Device& device) {
  int packed = 0, unrolled = 0;
  for (const KernelProfile& k : device.profile()) {
    packed += k.kernel.starts_with("nn/conv_cpu.cl:") || k.kernel.starts_with("nn/conv_gpu.cl:");
    unrolled += k.kernel.starts_with("nn/im2col.cl:");
  }
  device.set_profiling(false);
  EXPECT_EQ(packed > 0, setting.gemm == "packed") << setting.gemm;
  EXPECT_EQ(unrolled > 0, setting.gemm == "clblast") << setting.gemm;
}

Results infer(const Setting& setting) {
  Graph graph;
  const Maps maps = mgnet(graph, graph.input("image", {kBatch, 3, kHeight, kWidth}), kNet, false);
  const std::map<std::string, Value> wanted{{"albedo", maps.albedo},
                                            {"material", maps.material},
                                            {"normal", maps.normal},
                                            {"depth", maps.depth},
                                            {"log_scale", maps.log_scale}};
  std::vector<Value> outputs;
  for (const auto& [name, value] : wanted) outputs.push_back(value);
  Device device = profiled_device(setting);
  Executor run(compile(graph, outputs, device, {.precision = setting.precision, .gemm = setting.gemm}),
               starting_states(graph, device, setting));
  run.feed("image", batch().at("image"));
  run.run();
  Results results;
  for (const auto& [name, value] : wanted) results[name] = run.fetch(value).real;
  expect_kernels_of(setting, device);
  return results;
}

struct Training {
  Results gradients;  // of every parameter, in the first step
  Results losses;     // every term, of each step
};

Training train(const Setting& setting) {
  Graph graph;
  const MgnetTraining net =
      mgnet_training(graph, kNet, {.batch = kBatch, .height = kHeight, .width = kWidth, .adam = {.beta1 = 0.5}});
  std::vector<Value> outputs;
  for (const auto& [name, value] : net.losses) outputs.push_back(value);
  Device device = profiled_device(setting);
  const auto states = starting_states(graph, device, setting);
  Executor run(compile(graph, outputs, device, {.precision = setting.precision, .gemm = setting.gemm}, true), states);
  for (const auto& [name, tensor] : batch()) run.feed(name, tensor);
  Training results;
  for (int step = 1; step <= kSteps; ++step) {
    run.feed("step", Tensor({}, step));
    run.run();
    for (const auto& [name, value] : net.losses) results.losses[name].push_back(run.fetch(value).real[0]);
    if (step > 1) continue;
    // From zero, Adam's first moment is (1 - beta1) = 1/2 of the gradient, exactly.
    for (const Value& p : graph.parameters()) {
      std::vector<double>& gradient = results.gradients[name_of(p)];
      gradient = states->get("adam.m." + name_of(p)).real;
      for (double& g : gradient) g *= 2;
    }
  }
  expect_kernels_of(setting, device);
  return results;
}

double largest(const std::vector<double>& values) {
  double m = 0;
  for (const double v : values) m = std::max(m, std::abs(v));
  return m;
}

double farthest(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double m = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double distance = std::abs(a[i] - b[i]);
    if (!(distance <= m)) m = distance;  // NaN stays
  }
  return m;
}

void expect_within_rounding(const Results& twin, const std::vector<Results>& moved, const Results& packed,
                            const Results& clblast) {
  int different = 0;
  ASSERT_EQ(packed.size(), twin.size());
  ASSERT_EQ(clblast.size(), twin.size());
  for (const auto& [name, exact] : twin) {
    double reach = 0;
    for (const Results& m : moved) reach = std::max(reach, farthest(m.at(name), exact));
    const double size = largest(exact), bound = kMargin * reach + 4 * FLT_EPSILON * size;
    EXPECT_GT(size, 0) << name << " is all zeros: it tests nothing";
    EXPECT_LE(bound, 1e-3 * size) << name << ": so much is no rounding, and hides errors";
    EXPECT_LE(farthest(packed.at(name), exact), bound) << name << ", packed; largest " << size;
    EXPECT_LE(farthest(clblast.at(name), exact), bound) << name << ", CLBlast; largest " << size;
    different += packed.at(name) != clblast.at(name);
  }
  EXPECT_GT(different, 0) << "two orders of summation that agree in every bit are one";
}

Setting moved_twin(int run) { return {kTwin.gemm, kTwin.precision, run}; }

TEST(Backends, InferTheSameWithinRounding) {
  std::vector<Results> moved;
  for (int i = 1; i <= kMovedRuns; ++i) moved.push_back(infer(moved_twin(i)));
  expect_within_rounding(infer(kTwin), moved, infer(kPacked), infer(kClblast));
}

// Parameters are not compared: Adam's first steps follow the sign of a gradient however small, and where it is near
// zero rounding decides it. That moves the loss by no more than the gradient's error times the step, so losses are
// compared, and the moved twins, whose signs turn in the same way, bound them.
TEST(Backends, TrainTheSameWithinRounding) {
  std::vector<Results> moved_gradients, moved_losses;
  for (int i = 1; i <= kMovedRuns; ++i) {
    const Training moved = train(moved_twin(i));
    moved_gradients.push_back(moved.gradients), moved_losses.push_back(moved.losses);
  }
  const Training twin = train(kTwin), packed = train(kPacked), clblast = train(kClblast);
  expect_within_rounding(twin.gradients, moved_gradients, packed.gradients, clblast.gradients);
  expect_within_rounding(twin.losses, moved_losses, packed.losses, clblast.losses);
  for (const Training* t : {&twin, &packed, &clblast})
    EXPECT_LT(t->losses.at("loss").back(), 0.95 * t->losses.at("loss").front()) << "nothing was trained";
}

}  // namespace
}  // namespace clerestory
