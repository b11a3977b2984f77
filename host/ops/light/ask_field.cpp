#include "host/ops/light/ask_field.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "host/ops/light/net_layers.hpp"
#include "host/ops/light/packed_layers.hpp"
#include "host/ops/light/rays.hpp"
#include "host/ops/tensor/rows.hpp"

namespace clerestory {
namespace {

constexpr int kMostOctaves = 10;
constexpr int kBlock = 8192;  // points of rays whose layers are products of a BLAS at a time

/// What kernels/light/ask_field.cl takes as its argument `net`.
struct FieldLayers {
  int count = 0;
  std::array<int, kMostFieldLayers + 1> width{};
};

// Inputs: points, directions, range, background, then list and count when `listed`, then a weight and a bias per layer.
struct AskFieldOp : NotDifferentiable {
  FieldOptions options;
  bool listed;
  int layers;
  AskFieldOp(const FieldOptions& o, bool l, int n) : options(o), listed(l), layers(n) {}
  std::string name() const override { return "ask_field"; }

  int first_layer() const { return listed ? 6 : 4; }

  template <class ShapeOf>
  FieldLayers field(const ShapeOf& shape_of) const {
    FieldLayers net{layers, {}};
    net.width[0] = 3 + 6 * options.octaves;
    for (int i = 0; i < layers; ++i) net.width[static_cast<std::size_t>(i) + 1] = shape_of(first_layer() + 2 * i).n;
    return net;
  }
  FieldLayers field(const Node& node) const {
    return field([&](int i) -> const Shape& { return node.in_shape(i); });
  }

  std::vector<Signature> infer(std::span<const Value> in) const override {
    check_rays(in[1], 3, "ask_field"), check_points(in[0], in[1], "ask_field");
    const Shape &rays = in[1].shape(), &range = in[2].shape();
    if (!(range == Shape{1, 3, 1, 1}))
      throw Error(ErrorKind::Failed, "the field is of one picture, so is its range of depths", "ask_field",
                  range.text(), "1x3x1x1");
    if (!(in[3].shape() == Shape{1, 3, 1, 1}))
      throw Error(ErrorKind::Failed, "what is behind the field is one colour", "ask_field", in[3].shape().text(),
                  "1x3x1x1");
    if (listed) check_list(in[4], in[5], rays, "ask_field");
    const FieldLayers net = field([&](int i) -> const Shape& { return in[static_cast<std::size_t>(i)].shape(); });
    for (int i = 0; i < layers; ++i) {
      const std::size_t at = static_cast<std::size_t>(first_layer() + 2 * i);
      const int out = net.width[static_cast<std::size_t>(i) + 1];
      if (out < 1 || out > kMostFieldWidth || (i + 1 == layers && out != 4))
        throw Error(ErrorKind::Failed, fmt::format("layer {} has a width that it cannot have", i), "ask_field",
                    std::to_string(out), i + 1 == layers ? "4: red, green, blue, density" : "1 to 64");
      check_layer(in[at], in[at + 1], net.width[static_cast<std::size_t>(i)], out, "ask_field");
    }
    return {{{1, 3, rays.h, rays.w}, Type::Real}};
  }

  std::size_t workspace(const Node& node) const override {
    const FieldLayers net = field(node);
    std::size_t count = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(layers); ++i)
      count += packed_elements(net.width[i], net.width[i + 1]);
    const long rays = std::min<long>(node.outputs[0].shape.plane(), block_rays());
    return std::max(count, size(rays * options.march.segments * (1 + 2 * widest(net))));
  }

  int block_rays() const { return std::max(1, kBlock / options.march.segments); }
  static int widest(const FieldLayers& net) { return *std::ranges::max_element(net.width); }

  void launch(Launch& l) const override {
    if (by_products(l)) return launch_products(l);
    std::size_t at = 0;
    for (int i = 0; i < layers; ++i)
      at = pack_layer(l, l.in(first_layer() + 2 * i), &l.in(first_layer() + 2 * i + 1), at);
    const FieldLayers net = field([&](int i) -> const Shape& { return l.in(i).shape; });
    const TensorView& y = l.out();
    clear_output(l);
    const RayTile t = ray_tile(l, y.shape);
    const TensorView &list = l.in(listed ? 4 : 0), &count = l.in(listed ? 5 : 0);
    const int rows = activation_rows(widest(net));
    const NetLaunch run = net_launch(l, y.shape.plane(), widest(net), 2 * rows);
    l.run_with(run.defines, "light/ask_field.cl", "ask_field", run.range, l.in(0), l.in(1), l.in(2), list, count,
               l.in(3), l.workspace, y, t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity,
               t.sample_capacity, static_cast<int>(listed), static_cast<int>(l.in(0).shape.w != y.shape.w),
               options.march.segments, Launch::Real{options.march.near}, Launch::Real{options.march.radius},
               static_cast<int>(options.march.jitter), l.seed, options.octaves, net,
               static_cast<int>(!options.released_output), rows, run.memory);
  }

  void launch_products(Launch& l) const {
    clear_output(l);
    const RayTile t = ray_tile(l, l.out().shape);
    const int asked = asked_rays(l, t, listed ? &l.in(5) : nullptr);
    for (int first = 0; first < asked; first += block_rays())
      launch_block(l, t, first, std::min(block_rays(), asked - first));
  }

  void launch_block(Launch& l, const RayTile& t, int first, int rays) const {
    const FieldLayers net = field([&](int i) -> const Shape& { return l.in(i).shape; });
    const int segments = options.march.segments, columns = rays * segments, is_listed = listed;
    const TensorView& list = l.in(listed ? 4 : 0);
    const int lengths = 0;
    WorkMatrix from{columns, net.width[0]}, to{columns + widest(net) * columns, 0};
    l.run(kNetProducts, "encode_points", Range::of2(size(rays), size(segments)), l.in(0), l.in(1), l.in(2), list,
          l.workspace, t.first_pixel, t.pixels, t.first_sample, t.samples, t.pixel_capacity, t.sample_capacity,
          is_listed, first, rays, from.at, lengths, static_cast<int>(l.in(0).shape.w != l.out().shape.w), segments,
          Launch::Real{options.march.near}, Launch::Real{options.march.radius}, static_cast<int>(options.march.jitter),
          l.seed, options.octaves);
    for (int i = 0; i < layers; ++i) {
      to.numbers = net.width[static_cast<std::size_t>(i) + 1];
      begin_layer(l, l.in(first_layer() + 2 * i + 1), to, i > 0 ? &from : nullptr, columns);
      add_product(l, l.in(first_layer() + 2 * i), from, to, columns);
      std::swap(from, to);
    }
    l.run(kNetProducts, "composite_points", Range::of(size(rays)), l.workspace, l.in(3), list, l.out(), is_listed,
          first, rays, from.at, lengths, segments, static_cast<int>(!options.released_output),
          static_cast<std::uint64_t>(l.out().shape.plane()));
  }

  /// Of all rays: how many are listed is known on the device only.
  Cost cost(const Node& node) const override {
    const FieldLayers net = field(node);
    double products = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(layers); ++i)
      products += static_cast<double>(net.width[i]) * net.width[i + 1];
    const double rays = static_cast<double>(node.outputs[0].shape.plane());
    return {2 * products * options.march.segments * rays, Op::cost(node).bytes};
  }
};

}  // namespace

Value ask_field(std::span<const Value> weights, std::span<const Value> biases, Value points, Value directions,
                Value range, const RayList& list, const FieldOptions& options, Value background) {
  const std::size_t layers = weights.size();
  if (layers < 1 || layers > kMostFieldLayers || biases.size() != layers)
    throw Error(ErrorKind::Failed, "a field has as many weights as biases", "ask_field",
                fmt::format("{} and {}", layers, biases.size()), "1 to 5");
  if (options.octaves < 0 || options.octaves > kMostOctaves)
    throw Error(ErrorKind::Failed, "octaves out of range", "ask_field", std::to_string(options.octaves), "0 to 10");
  if (options.march.segments < 1 || !(options.march.near >= 0) || !(options.march.radius > 0))
    throw Error(ErrorKind::Failed, "segments, near distance or radius out of range", "ask_field");
  std::vector<Value> inputs{points, directions, range, background ? background : range.graph().fill({1, 3, 1, 1}, 0)};
  if (list) inputs.insert(inputs.end(), {list.rays, list.count});
  for (std::size_t i = 0; i < layers; ++i) inputs.insert(inputs.end(), {weights[i], biases[i]});
  return points.graph().make<AskFieldOp>(std::move(inputs), options, static_cast<bool>(list), static_cast<int>(layers));
}

}  // namespace clerestory
