// Matrix products: exact equality with a plain reference on integers for the three transpositions and both ways to hold
// a matrix, on every set of kernels, with gradients against finite differences in double.
#include "host/ops/nn/gemm.hpp"

#include "checks/op_case.hpp"

namespace clerestory {
namespace {

struct Product {
  std::string label;
  int rows, columns, depth;
  bool transpose_a = false, transpose_b = false;
  bool channels = false;  // matrices as {rows,columns,1,1} rather than {1,1,rows,columns}
  bool bias = false;      // linear()
};

Shape shape(const Product& p, int rows, int columns) {
  return p.channels ? Shape{rows, columns, 1, 1} : Shape{1, 1, rows, columns};
}

Tensor integers(Shape s, std::uint64_t seed) {
  const Tensor t = random_ints(s, seed, -3, 4);
  return {s, std::vector<double>(t.integer.begin(), t.integer.end())};
}

OpCase product_case(const Product& p, const std::string& name, ConvKernels kernels, std::vector<std::string> launched) {
  OpCase c;
  c.stem = "gemm", c.label = p.label + "_" + name;
  c.kernels = std::move(launched);
  if (kernels == ConvKernels::Gpu) c.group = 128;
  c.inputs["a"] = integers(p.transpose_a ? shape(p, p.depth, p.rows) : shape(p, p.rows, p.depth), 1);
  c.inputs["b"] = integers(p.transpose_b ? shape(p, p.columns, p.depth) : shape(p, p.depth, p.columns), 2);
  if (p.bias) c.inputs["bias"] = integers({1, p.columns, 1, 1}, 3);
  c.build = [=](Graph&, const Values& v) -> std::vector<Value> {
    if (p.bias) return {linear(v.at("a"), v.at("b"), v.at("bias"), kernels)};
    return {matmul(v.at("a"), v.at("b"), {p.transpose_a, p.transpose_b, kernels})};
  };
  c.reference = [=](const Tensors& in) -> std::vector<Tensor> {
    const std::vector<double>&a = in.at("a").real, &b = in.at("b").real;
    Tensor out(shape(p, p.rows, p.columns));
    for (int i = 0; i < p.rows; ++i)
      for (int j = 0; j < p.columns; ++j) {
        double sum = p.bias ? in.at("bias").real[j] : 0;
        for (int k = 0; k < p.depth; ++k)
          sum += a[p.transpose_a ? k * p.rows + i : i * p.depth + k] *
                 b[p.transpose_b ? j * p.depth + k : k * p.columns + j];
        out.real[i * p.columns + j] = sum;
      }
    return {out};
  };
  c.roundings = 0;
  c.differentiate = {"a", "b"};
  if (p.bias) c.differentiate.push_back("bias");
  c.step = 0.5, c.gradient_tolerance = 1e-10, c.differences = 25;  // bilinear: see conv.cpp
  c.gradient_roundings = 256;
  return c;
}

OP_CASES(gemm) {
  const std::vector<Product> products{
      {"plain", 7, 33, 65},
      {"transposed_a", 13, 40, 21, true, false},
      {"transposed_b", 9, 20, 50, false, true},
      {"long_inner", 5, 3, 5000, false, true},
      {"rows_a_page_apart", 11, 20, 1024},  // packed on CPUs: see read_as_stored
      {"single", 1, 1, 1},
      {"wide", 3, 2000, 17},
      {"channels", 6, 19, 70, false, false, true},
      {"linear", 5, 12, 37, false, true, true, true},
  };
  std::vector<OpCase> cases;
  for (const Product& p : products) {
    const bool partials = p.bias || p.label == "long_inner";
    std::vector<std::string> cpu{!p.transpose_b ? "conv_cpu"
                                 : p.rows > 8   ? "conv_weights_outer"
                                                : "conv_weights_dot"},
        gpu{p.transpose_b ? "conv_weights_gpu" : "conv_gpu"};
    if (p.transpose_a || p.depth % 1024 == 0) cpu.push_back("conv_pack_weights");
    if (partials) cpu.push_back("conv_sum_partials"), gpu.push_back("conv_sum_partials");
    cases.push_back(product_case(p, "cpu", ConvKernels::Cpu, cpu));
    cases.push_back(product_case(p, "gpu", ConvKernels::Gpu, gpu));
  }
  // Its only kernel of ours; the products themselves are CLBlast's.
  cases.push_back(product_case(products.back(), "clblast", ConvKernels::Clblast, {"conv_fill_bias"}));
  return cases;
}

}  // namespace
}  // namespace clerestory
