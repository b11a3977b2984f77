// Values on the host: what is fed to a graph and fetched from it. Reals are kept in double whatever the device computes
// in, so that one test compares float and double plans.
#pragma once
#include <vector>

#include "host/graph/shape.hpp"

namespace clerestory {

struct Tensor {
  Shape shape;
  std::vector<double> real;  // filled when the type is Real
  std::vector<int> integer;  // filled when the type is Int

  Tensor() = default;
  explicit Tensor(Shape s, double value = 0) : shape(s), real(static_cast<std::size_t>(s.count()), value) {}
  Tensor(Shape s, std::vector<double> values) : shape(s), real(std::move(values)) {}
  Tensor(Shape s, const std::vector<float>& values) : shape(s), real(values.begin(), values.end()) {}
  static Tensor of_int(Shape s, std::vector<int> values) {
    Tensor t;
    t.shape = s, t.integer = std::move(values);
    return t;
  }

  Type type() const { return integer.empty() ? Type::Real : Type::Int; }
  double& at(int n, int c, int y, int x) { return real[index(n, c, y, x)]; }
  double at(int n, int c, int y, int x) const { return real[index(n, c, y, x)]; }
  std::vector<float> floats() const { return {real.begin(), real.end()}; }

 private:
  std::size_t index(int n, int c, int y, int x) const {
    return ((static_cast<std::size_t>(n) * shape.c + c) * shape.h + y) * shape.w + x;
  }
};

}  // namespace clerestory
