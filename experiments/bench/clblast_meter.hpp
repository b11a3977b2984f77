// How fast, and how right, CLBlast is with a set of parameters: products at the sizes of the nets.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "host/graph/plan.hpp"
#include "host/tuning/tuning.hpp"

namespace clerestory {

struct Product {
  int rows = 0, columns = 0, depth = 0;
  bool transpose_a = false, transpose_b = false;
  bool timed = true;
  double volume() const { return static_cast<double>(rows) * columns * depth; }
  double flops() const { return 2 * volume(); }
  std::string text() const;  // "64x9600x576", "AT 576x9600x64"
};

/// What became of one product.
struct ProductTrial {
  double own = 0, seconds = 0;  // best seconds by CLBlast's own parameters and by those that are measured
  std::string fault;            // it computes wrongly, or fails
};

/// Products of whole numbers, whose every sum is exact in float: any rounding is a fault.
class ClblastMeter {
 public:
  ClblastMeter(Device device, std::vector<Product> products, int rounds);
  ~ClblastMeter();
  ClblastMeter(const ClblastMeter&) = delete;
  ClblastMeter& operator=(const ClblastMeter&) = delete;

  const std::vector<Product>& products() const { return products_; }

  /// Checks each product by these parameters, then times it beside CLBlast's own, turn by turn. A fault of one product
  /// ends it.
  std::vector<ProductTrial> measure(const ClblastParameters& parameters);

 private:
  struct Work;
  std::string fault(const ClblastParameters& parameters, Work& work);
  Device device_;
  std::vector<Product> products_;
  int rounds_;
  std::vector<std::unique_ptr<Work>> works_;
};

}  // namespace clerestory
