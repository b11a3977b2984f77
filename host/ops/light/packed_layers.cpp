#include "host/ops/light/packed_layers.hpp"

#include "host/cl/tile.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr int kTile = 8;  // of kernels/light/mlp.clh

long panels(int out) { return (out + kTile - 1) / kTile; }

}  // namespace

std::size_t packed_elements(int in, int out) { return size(panels(out) * kTile * (in + 1)); }

std::size_t pack_layer(Launch& l, const TensorView& weight, const TensorView* bias, std::size_t at) {
  const int in = weight.shape.c, out = weight.shape.n;
  l.run("light/pack_layer.cl", "pack_layer", Range::of2(size(in + 1), size(panels(out))), weight, bias ? *bias : weight,
        l.workspace, in, out, static_cast<int>(bias != nullptr), static_cast<int>(at));
  return at + packed_elements(in, out);
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
