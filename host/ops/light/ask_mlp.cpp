#include "host/ops/light/ask_mlp.hpp"

#include <algorithm>
#include <utility>

#include "host/ops/light/net_layers.hpp"
#include "host/ops/light/packed_layers.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr int kBlock = 2048;  // rays whose layers are products of a BLAS at a time

// Inputs: rows, hit, direction, frequencies; list and count when `listed`; the weights by append_mlp().
struct AskMlpOp : NotDifferentiable {
  bool listed;
  int layers, again;
  AskMlpOp(bool l, int n, int a) : listed(l), layers(n), again(a) {}
  std::string name() const override { return "ask_mlp"; }

  int first_layer() const { return listed ? 6 : 4; }

  std::vector<MlpPart> parts() const { return mlp_parts(first_layer(), layers, again); }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[1], 1, "ask_mlp"), check_rays(in[2], 3, "ask_mlp");
    const Shape &rows = in[0].shape(), &hit = in[1].shape(), &direction = in[2].shape(), &waves = in[3].shape();
    const int width = in[static_cast<std::size_t>(first_layer())].shape().n, features = 2 * waves.n;
    if (in[1].type() != Type::Int || hit.h != direction.h || hit.w != direction.w)
      throw Error(ErrorKind::Failed, "hit pixels (integers) and directions are of different rays", "ask_mlp",
                  hit.text(), direction.text());
    if (listed) check_list(in[4], in[5], hit, "ask_mlp");
    if (width < 16 || width % 16 != 0 || width > kMostMlpWidth)
      throw Error(ErrorKind::Failed, "a width that this kernel does not have", "ask_mlp", std::to_string(width),
                  "a multiple of 16, at most 512");
    if (waves.c != 3 || waves.plane() != 1 || waves.n > kMostMlpFrequencies)
      throw Error(ErrorKind::Failed, "frequencies of another kind", "ask_mlp", waves.text(), "mx3x1x1, m up to 256");
    const Shape want{1, 1, rows.h, again > 0 ? 2 * width : width};
    if (!(rows == want)) throw Error(ErrorKind::Failed, "rows of another net", "ask_mlp", rows.text(), want.text());
    check_mlp(in, parts(), features, width, "ask_mlp");
    return {{{1, 3, hit.h, hit.w}, Type::Real}};
  }

  std::size_t workspace(const Node& node) const override {
    std::size_t count = 0;
    for (const MlpPart& part : parts())
      count += packed_elements(node.in_shape(part.weight).c, node.in_shape(part.weight).n);
    const auto numbers = static_cast<std::size_t>(2 * node.in_shape(first_layer()).n + 2 * node.in_shape(3).n);
    const auto rays = static_cast<std::size_t>(std::min<long>(node.outputs[0].shape.plane(), kBlock));
    return std::max(count, rays * numbers);
  }

  void launch(Launch& l) const override {
    if (by_products(l)) return launch_products(l);
    std::size_t at = 0;
    for (const MlpPart& part : parts())
      at = pack_layer(l, l.in(part.weight), part.bias < 0 ? nullptr : &l.in(part.bias), at);
    const TensorView& y = l.out();
    clear_output(l);
    const RayTile t = ray_tile(l, y.shape);
    const TensorView &list = l.in(listed ? 4 : 1), &count = l.in(listed ? 5 : 1);
    const int width = l.in(first_layer()).shape.n, waves = l.in(3).shape.n;
    const NetLaunch net = net_launch(l, y.shape.plane(), width, 2 * activation_rows(width) + 2 * waves);
    l.run_with(net.defines, "light/ask_mlp.cl", "ask_mlp", net.range, l.in(0), l.in(1), l.in(2), l.in(3), list, count,
               l.workspace, y, t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
               static_cast<int>(listed), l.in(0).shape.w, width, layers, waves, again, net.memory);
  }

  void launch_products(Launch& l) const {
    clear_output(l);
    const TensorView &y = l.out(), &list = l.in(listed ? 4 : 1);
    const RayTile t = ray_tile(l, y.shape);
    const int asked = asked_rays(l, t, listed ? &l.in(5) : nullptr);
    for (int first = 0; first < asked; first += kBlock)
      launch_block(l, t, list, first, std::min(kBlock, asked - first));
  }

  void launch_block(Launch& l, const RayTile& t, const TensorView& list, int first, int rays) const {
    const int width = l.in(first_layer()).shape.n, waves = l.in(3).shape.n, is_listed = listed;
    const auto plane = static_cast<std::uint64_t>(l.out().shape.plane());
    const auto range = [&](int rows) { return Range::of2(size(rays), size(rows)); };
    const WorkMatrix along{0, 2 * waves};
    WorkMatrix from{along.numbers * rays, 0}, to{from.at + width * rays, 0};
    l.run(kNetProducts, "encode_directions", range(waves), l.in(2), l.in(3), list, l.workspace, is_listed, first, rays,
          along.at, waves, plane);
    int at = first_layer();
    for (int layer = 0; layer <= layers; ++layer) {  // the last one answers
      const int hidden = layer > 0, reads = layer == 0 || (again > 0 && layer == again);
      to.numbers = layer < layers ? width : 3;
      begin_layer(l, l.in(at + hidden + reads), to, hidden ? &from : nullptr, rays);
      if (reads) {
        l.run(kNetProducts, "add_rows", range(width), l.in(0), l.in(1), list, l.workspace, is_listed, first, rays,
              to.at, l.in(0).shape.w, hidden ? width : 0, t.samples, t.sample_capacity);
        add_product(l, l.in(at + hidden), along, to, rays);
      }
      if (hidden) add_product(l, l.in(at), from, to, rays);
      at += 1 + hidden + reads;
      std::swap(from, to);
    }
    l.run(kNetProducts, "put_answers", range(3), l.workspace, l.in(1), list, l.out(), is_listed, first, rays, from.at,
          t.samples, t.sample_capacity, plane);
  }

  /// Of all rays: how many are listed is known on the device only.
  Cost cost(const Node& node) const override {
    double products = 0;
    for (const MlpPart& part : parts()) products += static_cast<double>(node.in_shape(part.weight).count());
    const double rays = static_cast<double>(node.outputs[0].shape.plane());
    return {2 * products * rays, Op::cost(node).bytes};
  }
};

}  // namespace

Value ask_mlp(const LightMlp& mlp, Value frequencies, Value rows, Value hit, Value direction, const RayList& list) {
  std::vector<Value> inputs{rows, hit, direction, frequencies};
  if (list) inputs.insert(inputs.end(), {list.rays, list.count});
  append_mlp(mlp, inputs, "ask_mlp");
  return rows.graph().make<AskMlpOp>(std::move(inputs), static_cast<bool>(list), static_cast<int>(mlp.biases.size()),
                                     mlp.again);
}

}  // namespace clerestory
