#include "host/ops/light/ask_mlp.hpp"

#include "host/ops/light/packed_layers.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

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
    return count;
  }

  void launch(Launch& l) const override {
    std::size_t at = 0;
    for (const MlpPart& part : parts())
      at = pack_layer(l, l.in(part.weight), part.bias < 0 ? nullptr : &l.in(part.bias), at);
    const TensorView& y = l.out();
    clear_output(l);
    const RayTile t = ray_tile(l, y.shape);
    const TensorView &list = l.in(listed ? 4 : 1), &count = l.in(listed ? 5 : 1);
    l.run_with(net_defines(l.device), "light/ask_mlp.cl", "ask_mlp", net_range(l.device, y.shape.plane()), l.in(0),
               l.in(1), l.in(2), l.in(3), list, count, l.workspace, y, t.first_pixel, t.pixels, t.first_sample,
               t.samples, t.pixel_capacity, t.sample_capacity, static_cast<int>(listed), l.in(0).shape.w,
               l.in(first_layer()).shape.n, layers, l.in(3).shape.n, again);
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
