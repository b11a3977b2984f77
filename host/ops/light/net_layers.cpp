#include "host/ops/light/net_layers.hpp"

#include <algorithm>

#include "host/ops/nn/conv_backend.hpp"

namespace clerestory {

int asked_rays(Launch& l, const RayTile& tile, const TensorView* count) {
  int asked = tile.pixels * tile.sample_capacity;
  if (count) l.device.read(count->buffer, &asked, sizeof asked, count->offset * sizeof asked);
  return asked;
}

void begin_layer(Launch& l, const TensorView& bias, const WorkMatrix& to, const WorkMatrix* before, int columns) {
  const WorkMatrix from = before ? *before : WorkMatrix{};
  const int rows = std::max(to.numbers, from.numbers);
  l.run(kNetProducts, "begin_layer", Range::of2(static_cast<std::size_t>(columns), static_cast<std::size_t>(rows)),
        bias, l.workspace, columns, to.at, to.numbers, from.at, from.numbers);
}

void add_product(Launch& l, const TensorView& weight, const WorkMatrix& from, const WorkMatrix& to, int columns) {
  const auto at = [](const WorkMatrix& m) { return static_cast<std::uint64_t>(m.at); };
  clblast_gemm(l, weight.shape.n, columns, weight.shape.c, {weight, 0, item_pitch(weight)},
               {l.workspace, at(from), columns}, 1, {l.workspace, at(to), columns});
}

}  // namespace clerestory
