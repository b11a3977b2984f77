#include "checks/op_case.hpp"

#include <random>

namespace clerestory {
namespace {

using Maker = std::vector<OpCase> (*)();

std::vector<Maker>& makers() {
  static std::vector<Maker> all;
  return all;
}

}  // namespace

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

const std::vector<OpCase>& declared_cases() {
  static const std::vector<OpCase> all = [] {
    std::vector<OpCase> cases;
    for (const Maker make : makers())
      for (OpCase& c : make()) cases.push_back(std::move(c));
    return cases;
  }();
  return all;
}

bool declare_cases(std::vector<OpCase> (*make)()) {
  makers().push_back(make);
  return true;
}

}  // namespace clerestory
