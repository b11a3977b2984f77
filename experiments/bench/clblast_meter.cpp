#include "experiments/bench/clblast_meter.hpp"

#include <algorithm>
#include <limits>

#include "host/cl/seconds_of.hpp"
#include "host/cl/small_integers.hpp"
#include "host/ops/nn/clblast_parameters.hpp"
#include "host/ops/nn/gemm.hpp"

namespace clerestory {
namespace {

std::vector<float> transposed(const std::vector<float>& from, int rows, int columns) {
  std::vector<float> to(from.size());
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      to[static_cast<std::size_t>(c) * rows + r] = from[static_cast<std::size_t>(r) * columns + c];
  return to;
}

std::vector<float> product_of(const Product& p, const std::vector<float>& a, const std::vector<float>& b) {
  std::vector<float> c(static_cast<std::size_t>(p.rows) * p.columns);
  for (int r = 0; r < p.rows; ++r) {
    float* out = c.data() + static_cast<std::size_t>(r) * p.columns;
    for (int k = 0; k < p.depth; ++k) {
      const float factor = a[static_cast<std::size_t>(r) * p.depth + k];
      const float* row = b.data() + static_cast<std::size_t>(k) * p.columns;
      for (int i = 0; i < p.columns; ++i) out[i] += factor * row[i];
    }
  }
  return c;
}

}  // namespace

std::string Product::text() const {
  return fmt::format("{}{}x{}x{}", transpose_a ? "AT " : transpose_b ? "BT " : "", rows, columns, depth);
}

struct ClblastMeter::Work {
  Product product;
  Graph graph;
  Value result;
  std::unique_ptr<Executor> run;
  std::vector<float> expected;

  Work(const Product& p, Device& device) : product(p) {
    // Of two bits: sums over depths below 2^22 stay exact.
    const auto a = small_integers<float>(static_cast<std::size_t>(p.rows) * p.depth, 1, 2);
    const auto b = small_integers<float>(static_cast<std::size_t>(p.columns) * p.depth, 2, 2);
    const int a_rows = p.transpose_a ? p.depth : p.rows, b_rows = p.transpose_b ? p.columns : p.depth;
    const Value left = graph.input("a", {1, 1, a_rows, p.transpose_a ? p.rows : p.depth});
    const Value right = graph.input("b", {1, 1, b_rows, p.transpose_b ? p.depth : p.columns});
    result = matmul(left, right, {p.transpose_a, p.transpose_b});
    run = std::make_unique<Executor>(compile(graph, {result}, device, {.gemm = "clblast"}));
    run->feed("a", p.transpose_a ? transposed(a, p.rows, p.depth) : a);
    run->feed("b", p.transpose_b ? transposed(b, p.depth, p.columns) : b);
    expected = product_of(p, a, b);
  }
};

ClblastMeter::ClblastMeter(Device device, std::vector<Product> products, int rounds)
    : device_(std::move(device)), products_(std::move(products)), rounds_(rounds) {
  for (const Product& product : products_) works_.push_back(std::make_unique<Work>(product, device_));
}

ClblastMeter::~ClblastMeter() = default;

std::string ClblastMeter::fault(const ClblastParameters& parameters, Work& work) {
  // What an earlier run has left must not pass for a result.
  const TensorView out = work.run->view(work.result);
  const std::vector<float> poison(work.expected.size(), 1e9f);
  device_.write(out.buffer, poison.data(), poison.size() * sizeof(float), out.offset * sizeof(float));
  try {
    use_clblast_parameters(device_, parameters);
    work.run->run();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::Device && error.kind() != ErrorKind::Usage) throw;
    return error.what();
  }
  const std::vector<float> found = work.run->fetch_floats(work.result);
  const auto differs = std::ranges::mismatch(found, work.expected).in1;
  if (differs == found.end()) return {};
  const auto at = static_cast<std::size_t>(differs - found.begin());
  return fmt::format("the product {} of whole numbers gives {} instead of {}", work.product.text(), *differs,
                     work.expected[at]);
}

std::vector<ProductTrial> ClblastMeter::measure(const ClblastParameters& parameters) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  std::vector<ProductTrial> trials(works_.size(), {unknown, unknown, {}});
  const auto refused = [&] {
    return std::ranges::any_of(trials, [](const ProductTrial& trial) { return !trial.fault.empty(); });
  };
  for (std::size_t i = 0; i < works_.size() && !refused(); ++i) trials[i].fault = fault(parameters, *works_[i]);
  const auto timed = [&](const ClblastParameters& by, Work& work, double& best) {
    use_clblast_parameters(device_, by);
    best = std::min(best, seconds_of(device_, [&] { work.run->run(); }));
  };
  for (int round = 0; round <= rounds_ && !refused(); ++round)
    for (std::size_t i = 0; i < works_.size(); ++i) {
      if (!products_[i].timed) continue;
      double first = 0;  // builds: not counted
      timed({}, *works_[i], round > 0 ? trials[i].own : first);
      timed(parameters, *works_[i], round > 0 ? trials[i].seconds : first);
    }
  return trials;
}

}  // namespace clerestory
