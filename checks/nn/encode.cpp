#include "host/ops/nn/encode.hpp"

#include <cmath>

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

std::vector<Tensor> reference(const Tensors& t) {
  const Tensor &x = t.at("x"), &b = t.at("b");
  const int m = b.shape.n;
  Tensor y(Shape{x.shape.n, 2 * m, x.shape.h, x.shape.w});
  for (int n = 0; n < x.shape.n; ++n)
    for (int j = 0; j < m; ++j)
      for (int row = 0; row < x.shape.h; ++row)
        for (int column = 0; column < x.shape.w; ++column) {
          double turns = 0;
          for (int c = 0; c < x.shape.c; ++c) turns += b.at(j, c, 0, 0) * x.at(n, c, row, column);
          const double angle = 2 * M_PI * std::remainder(turns, 1.0);
          y.at(n, j, row, column) = std::sin(angle);
          y.at(n, m + j, row, column) = std::cos(angle);
        }
  return {y};
}

/// turns: the largest number of turns that a feature makes.
OpCase encode_case(const std::string& label, const Tensor& x, const Tensor& b, double turns) {
  OpCase c{.stem = "encode", .label = label, .kernels = {"encode", "encode_adjoint"}, .inputs = {{"x", x}, {"b", b}}};
  c.build = [](Graph&, const Values& v) { return std::vector{encode(v.at("x"), v.at("b"))}; };
  c.reference = reference;
  // A sum of C products of that size is rounded, and 2 pi turns it into an angle; then sine and cosine themselves.
  c.roundings = 2 * M_PI * turns * (x.shape.c + 1) + 4, c.magnitude = 1;
  c.differentiate = {"x"};
  c.step = 1e-5 / turns;
  return c;
}

OP_CASES(encode) {
  return {
      encode_case("random_fourier_features", random_tensor({2, 3, 4, 9}, 1), random_tensor({7, 3, 1, 1}, 2, -3, 3), 9),
      encode_case("octaves", random_tensor({1, 2, 3, 5}, 3, -2, 2), octave_frequencies(2, 6), 32),
      encode_case("quarter_turns", Tensor({1, 1, 1, 5}, std::vector<double>{-1, -0.25, 0, 0.5, 1.25}),
                  octave_frequencies(1, 3), 2.5)};
}

}  // namespace
}  // namespace clerestory
