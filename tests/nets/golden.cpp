#include "tests/nets/golden.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace clerestory {

std::map<std::string, Tensor> golden_maps(int batch, int height, int width) {
  std::map<std::string, Tensor> feeds;
  const auto put = [&](const std::string& name, int channels, double offset) {
    Tensor t = formula(name, {batch, channels, height, width});
    for (double& x : t.real) x += offset;
    feeds[name] = t;
  };
  put("image", 3, 0.5), put("albedo", 3, 0.5), put("material", 2, 0.5), put("normal", 3, 0), put("depth", 1, 0.5);
  for (const char* mask : {"albedo_mask", "geometry_mask", "material_mask"}) {
    put(mask, 1, 0);
    for (double& x : feeds[mask].real) x = x > -0.2;
  }
  return feeds;
}

Device device_for(Precision precision) {
  Device device = Device::open();
  if (precision == Precision::Single || device.has_double()) return device;
  for (const DeviceInfo& info : list_devices())
    if (info.fp64) return Device::open(std::to_string(info.index));
  throw Error(ErrorKind::Device, "no device here has doubles", "tests");
}

Tensor golden_weight(const std::string& name, const Shape& shape) {
  const bool weight = name.ends_with("weight"), norm = weight && shape.n == 1 && shape.plane() == 1;
  if (name.ends_with("running_mean")) return Tensor(shape, 0);
  if (name.ends_with("running_var")) return Tensor(shape, 1);
  if (name.starts_with("adam.")) return Tensor(shape, 0);
  Tensor t = formula(name, shape);
  if (name.starts_with("scale")) return t;
  const double fan_in = static_cast<double>(shape.item());
  for (double& u : t.real) {
    if (weight && !norm)
      u = static_cast<float>(u * std::sqrt(24 / fan_in));
    else
      u = (norm ? 1 : 0) + 0.25 * u;
  }
  return t;
}

void add_gradients(std::map<std::string, Value>& results, const std::string& prefix, std::span<const Value> outputs,
                   std::span<const Value> seeds, std::span<const Value> wrt) {
  const std::vector<Value> gradients = gradient(outputs, seeds, wrt);
  for (std::size_t i = 0; i < wrt.size(); ++i) {
    const auto* state = dynamic_cast<const StateOp*>(wrt[i].node->op.get());
    const std::string& name = state ? state->state_name : static_cast<const InputOp&>(*wrt[i].node->op).input_name;
    if (!gradients[i]) throw Error(ErrorKind::Failed, "there is no gradient", name);
    results[prefix + name] = gradients[i];
  }
}

Tensor formula(const std::string& name, const Shape& shape) {
  std::uint32_t h = 2166136261u;
  for (const char c : name) h = (h ^ static_cast<unsigned char>(c)) * 16777619u;
  Tensor t(shape);
  for (std::size_t i = 0; i < t.real.size(); ++i) {
    std::uint32_t z = h + static_cast<std::uint32_t>(i) * 2654435761u;
    z = (z ^ (z >> 16)) * 0x7feb352du;
    z = (z ^ (z >> 15)) * 0x846ca68bu;
    z ^= z >> 16;
    t.real[i] = static_cast<double>(z >> 8) * 0x1p-24 - 0.5;
  }
  return t;
}

GoldenNet::GoldenNet(const std::string& file, Precision p)
    : device(device_for(p)),
      precision(p),
      file_(read_safetensors(std::string(CLERESTORY_TEST_DATA) + "/nets/" + file)) {}

void GoldenNet::fill_states() {
  states_ = std::make_shared<States>(device, precision);
  for (const Value& v : graph.states()) {
    const auto& op = static_cast<const StateOp&>(*v.node->op);
    states_->set(op.state_name, golden_weight(op.state_name, op.shape));
  }
}

void GoldenNet::run(const std::map<std::string, Value>& results, const std::map<std::string, Tensor>& feeds,
                    bool updates) {
  std::vector<Value> outputs;
  for (const auto& [name, value] : results) outputs.push_back(value);
  Executor executor(compile(graph, outputs, device, {.precision = precision}, updates), states_);
  for (const auto& [name, tensor] : feeds) executor.feed(name, tensor);
  executor.run();
  for (const auto& [name, value] : results) results_[name] = executor.fetch(value);
}

std::vector<double> GoldenNet::stored_elements(const Tensor& t, std::size_t count) const {
  const std::size_t stride = t.real.size() / count;
  std::vector<double> elements;
  for (std::size_t i = 0; i < count; ++i) elements.push_back(t.real[i * stride]);
  return elements;
}

void GoldenNet::expect_close(const Tensor& t, const std::string& golden, double tolerance) {
  const std::vector<float>& want = file_.get(golden, "golden values").floats();
  ASSERT_LE(want.size(), t.real.size()) << golden;
  const std::vector<double> got = stored_elements(t, want.size());
  double largest = 0, worst = 0;
  for (const float w : want) largest = std::max(largest, std::abs(static_cast<double>(w)));
  for (std::size_t i = 0; i < want.size(); ++i) {
    const double error = std::abs(got[i] - static_cast<double>(want[i]));
    if (!(error <= worst)) worst = error;
  }
  EXPECT_GT(largest, 0) << golden << " is all zeros: it tests nothing";
  EXPECT_LE(worst, tolerance * largest) << golden << ", largest " << largest;
}

void GoldenNet::expect_elements(const std::string& result, const std::string& golden, double tolerance) {
  expect_close(results_.at(result), golden, tolerance);
}

void GoldenNet::expect_norm(const std::string& result, const std::string& golden, double tolerance) {
  const std::vector<float>& want = file_.get(golden, "golden values").floats();
  const std::vector<double> got = stored_elements(results_.at(result), want.size());
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < want.size(); ++i) {
    const double w = want[i];
    error += (got[i] - w) * (got[i] - w), norm += w * w;
  }
  EXPECT_GT(norm, 0) << golden << " is all zeros: it tests nothing";
  EXPECT_LE(std::sqrt(error), tolerance * std::sqrt(norm)) << golden;
}

void GoldenNet::expect_state(const std::string& state, const std::string& golden, double tolerance) {
  expect_close(states_->get(state), golden, tolerance);
}

}  // namespace clerestory
