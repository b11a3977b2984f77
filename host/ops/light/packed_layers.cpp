#include "host/ops/light/packed_layers.hpp"

#include <algorithm>

#include "host/cl/tile.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

// Of kernels/light/mlp.clh: outputs of a panel, vectors of rays of a work-item on a CPU, rays of a tile on a GPU.
constexpr int kTile = 8, kCpuVectors = 3, kLeastRays = 4;

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

int activation_rows(int width) { return static_cast<int>(panels(width)) * kTile; }

Defines net_defines(Device& device) {
  return row_group(device) == 1 ? row_defines(device, tile_defines(device)) : row_defines(device);
}

NetLaunch net_launch(Launch& l, long rays, int width, int numbers, int most) {
  const int group = row_group(l.device);
  if (group == 1)
    return {net_defines(l.device), lane_range(l.device, rays, kCpuVectors), Arg::local(real_size(l.precision))};
  const std::size_t each = size(numbers) * real_size(l.precision), room = l.device.info().local_room();
  int carried = std::min(most, group);
  while (carried > kLeastRays && (size(carried) * each > room || panels(width) * carried / kLeastRays > group))
    carried /= 2;
  if (group < kLeastRays || size(carried) * each > room)
    throw Error(ErrorKind::Device, "a net does not fit into the device's local memory", "light",
                fmt::format("{} bytes for {} rays, {} work-items", size(carried) * each, carried, group),
                fmt::format("at most {} bytes and at least {} work-items", room, kLeastRays));
  return {row_defines(l.device, {{"GROUP_RAYS", std::to_string(carried)}}),
          row_range(l.device, (rays + carried - 1) / carried), Arg::local(size(carried) * each)};
}

}  // namespace clerestory
