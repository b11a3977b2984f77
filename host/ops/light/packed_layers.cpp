#include "host/ops/light/packed_layers.hpp"

#include "host/cl/tile.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr int kTile = 8;  // of kernels/light/mlp.clh

long panels(int out) { return (out + kTile - 1) / kTile; }

}  // namespace

std::size_t packed_elements(int in, int out) { return size(panels(out) * kTile * (in + 1)); }

namespace {

std::size_t pack(Launch& l, const TensorView& weight, const TensorView* bias, int in, int out, bool transposed,
                 std::size_t at) {
  l.run("light/pack_layer.cl", "pack_layer", Range::of2(size(in + 1), size(panels(out))), weight, bias ? *bias : weight,
        l.workspace, in, out, static_cast<int>(bias != nullptr), static_cast<int>(at), static_cast<int>(transposed));
  return at + packed_elements(in, out);
}

}  // namespace

std::size_t pack_layer(Launch& l, const TensorView& weight, const TensorView* bias, std::size_t at) {
  return pack(l, weight, bias, weight.shape.c, weight.shape.n, false, at);
}

std::size_t pack_transposed(Launch& l, const TensorView& weight, std::size_t at) {
  return pack(l, weight, nullptr, weight.shape.n, weight.shape.c, true, at);
}

void check_layer(const Value& weight, const Value& bias, int in, int out, const char* op) {
  const Shape &w = weight.shape(), want{out, in, 1, 1}, want_bias{1, out, 1, 1};
  if (!(w == want)) throw Error(ErrorKind::Failed, "the weights of a layer do not fit", op, w.text(), want.text());
  if (bias && !(bias.shape() == want_bias))
    throw Error(ErrorKind::Failed, "the bias of a layer does not fit", op, bias.shape().text(), want_bias.text());
}

Defines net_defines(Device& device) {
  return row_group(device) == 1 ? row_defines(device, tile_defines(device)) : row_defines(device);
}

Range net_range(const Device& device, long rays) { return lane_range(device, rays, row_group(device) == 1 ? 3 : 2); }

}  // namespace clerestory
