// Convolutions of many sizes.
#pragma once
#include "checks/op_case.hpp"
#include "host/ops/nn/conv.hpp"

namespace clerestory::conv_sizes {

struct Sizes {
  std::string label;
  Shape x, w;
  int stride = 1, pad = 0;
  int scratch = 0;
  ConvSpec spec(ConvKernels kernels) const { return {stride, pad, kernels, scratch}; }
  Shape y() const { return {x.n, w.n, (x.h + 2 * pad - w.h) / stride + 1, (x.w + 2 * pad - w.w) / stride + 1}; }
};

inline Value build(const Sizes& s, ConvKernels kernels, const Values& v) {
  return conv(v.at("x"), v.at("w"), v.at("bias"), s.spec(kernels));
}

inline const std::vector<Sizes>& grid() {
  static const std::vector<Sizes> all{
      {"one_pixel", {2, 3, 1, 1}, {5, 3, 3, 3}, 1, 1},        {"odd", {2, 5, 9, 11}, {13, 5, 3, 3}, 1, 1},
      {"stride2", {2, 5, 13, 10}, {9, 5, 3, 3}, 2, 1},        {"seven_stride2", {1, 3, 20, 23}, {8, 3, 7, 7}, 2, 3},
      {"four_stride2", {1, 4, 12, 14}, {8, 4, 4, 4}, 2, 1},   {"four", {1, 2, 9, 8}, {3, 2, 4, 4}, 1, 2},
      {"pointwise", {3, 70, 5, 7}, {9, 70, 1, 1}, 1, 0},      {"pointwise_stride2", {2, 7, 9, 8}, {9, 7, 1, 1}, 2, 0},
      {"pointwise_padded", {1, 3, 4, 5}, {2, 3, 1, 1}, 1, 1}, {"stride3", {1, 2, 11, 10}, {3, 2, 2, 2}, 3, 0},
      {"valid", {1, 7, 20, 9}, {9, 7, 3, 3}, 1, 0},           {"bottom", {2, 24, 8, 10}, {16, 24, 3, 3}, 1, 1},
      {"wide", {1, 2, 3, 1500}, {3, 2, 3, 3}, 1, 1},          {"long_plane", {1, 17, 40, 60}, {16, 17, 1, 1}, 1, 0},
      {"stacked", {7, 11, 4, 5}, {70, 11, 3, 3}, 1, 1},       {"stacked_rows", {19, 20, 2, 3}, {33, 20, 1, 1}, 1, 0},
      {"columns", {2, 9, 2, 1400}, {17, 9, 3, 3}, 1, 1},      {"stride2_many", {2, 9, 15, 11}, {50, 9, 3, 3}, 2, 1},
      {"many_bands", {2, 6, 50, 40}, {9, 6, 3, 3}, 1, 1},     {"deep", {1, 300, 6, 5}, {80, 300, 3, 3}, 1, 1},
  };
  return all;
}

}  // namespace clerestory::conv_sizes
