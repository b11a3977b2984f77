// The networks of Li et al. 2020 against PyTorch on the same weights, and their sizes by count.
#include "nets/li2020.hpp"

#include <gtest/gtest.h>

#include "host/error.hpp"
#include "host/math/frames.hpp"
#include "host/ops/tensor/reshape.hpp"
#include "host/ops/tensor/slice.hpp"
#include "nets/mgnet.hpp"
#include "nets/mixed_light.hpp"
#include "tests/nets/golden.hpp"

namespace clerestory {
namespace {

constexpr Shape kImage{2, 3, 64, 84};
constexpr int kCells = 32 * 42, kDirections = 128;
const Li2020MapsSize kMaps{{16, 32, 16, 32, 16, 32}, {32, 16, 32, 16, 16, 16}};
const Li2020LightSize kLight{{16, 16}, {16, 32, 16, 32, 16, 32}, {32, 16, 32, 16, 16, 16}, 3};

/// Golden values are stored in float: 2^-24 of an element, and double's own rounding is far below.
constexpr double kStored = 0x1p-23;

Tensor hemisphere_grid() {
  Tensor directions(Shape{1, 3, kCells, kDirections});
  for (int s = 0; s < kDirections; ++s) {
    const Vec3 d = hemisphere_direction(s / 16, s % 16);
    for (int p = 0; p < kCells; ++p)
      for (int c = 0; c < 3; ++c) directions.at(0, c, p, s) = d[c];
  }
  return directions;
}

/// Lobes of the first picture as rows of rays have them.
Value rows_of(Value map) { return reshape(slice(item_of(map, 0), 0, map.shape().c), {1, map.shape().c, kCells, 1}); }

struct Network {
  GoldenNet net;
  std::map<std::string, Value> results;

  explicit Network(Precision precision) : net("li2020.safetensors", precision) {
    const Scope scope{net.graph, true, ""};
    const Value image = net.graph.input("image", kImage);
    const Li2020Maps maps = li2020_maps(scope, image, kMaps);
    const Li2020Lobes lobes = li2020_lobes(scope / "light", image, maps, kLight);
    results = {{"albedo", maps.albedo}, {"normal", maps.normal},        {"rough", maps.rough},   {"depth", maps.depth},
               {"axis", lobes.axis},    {"sharpness", lobes.sharpness}, {"weight", lobes.weight}};
    std::vector<Value> outputs, seeds;
    for (const auto& [name, value] : results) {
      outputs.push_back(value);
      seeds.push_back(net.graph.constant(formula("cotangent." + name, value.shape())));
    }
    add_gradients(results, "gradient.", outputs, seeds, net.graph.parameters());
    Gaussians light = li2020_gaussians(lobes, maps.normal);
    results["camera_axis"] = light.axis;
    light.axis = lobes.axis;  // as the golden values: in the hemisphere's own frame
    results["environment"] = spherical_gaussians({rows_of(light.axis), rows_of(light.sharpness), rows_of(light.weight)},
                                                 net.graph.constant(hemisphere_grid()));
    net.fill_states();
    Tensor picture = formula("image", kImage);
    for (double& x : picture.real) x += 0.5;
    net.run(results, {{"image", picture}}, true);
  }

  /// How far PyTorch's own float run lay from its doubles, doubled as both draw roundings at random.
  double float_error(const std::string& kind) const {
    return 2 * std::stod(net.golden().metadata.at("float_error_" + kind));
  }
};

TEST(Li2020, IsTheirsInDouble) {
  Network n(Precision::Double);
  for (const auto& [name, tensor] : n.net.golden().tensors) {
    ASSERT_TRUE(n.results.contains(name)) << name;
    n.net.expect_elements(name, name, 2 * kStored);
  }
  EXPECT_EQ(n.results.size(), n.net.golden().tensors.size());
}

TEST(Li2020, IsTheirsInFloat) {
  Network n(Precision::Single);
  for (const auto& [name, tensor] : n.net.golden().tensors)
    n.net.expect_norm(name, name, n.float_error(name.starts_with("gradient") ? "gradient" : "value"));
}

long parameters(const std::function<void(Graph&)>& build) {
  Graph graph;
  build(graph);
  long count = 0;
  for (const Value& v : graph.parameters()) count += v.shape().count();
  return count;
}

long maps_parameters(const std::string& preset) {
  return parameters([&](Graph& graph) {
    li2020_maps({graph, true, ""}, graph.input("image", {1, 3, 32, 32}), li2020_maps_size(preset));
  });
}

long light_parameters(const std::string& preset) {
  return parameters([&](Graph& graph) {
    const auto map = [&](const char* name, int channels) { return graph.input(name, {1, channels, 64, 64}); };
    li2020_lobes({graph, true, ""}, map("image", 3),
                 {map("albedo", 3), map("normal", 3), map("rough", 1), map("depth", 1), {}}, li2020_light_size(preset));
  });
}

TEST(Li2020, HasThePapersParameters) {
  EXPECT_EQ(maps_parameters("paper"), 44825932);
  EXPECT_EQ(light_parameters("paper"), 54456308);
}

/// |theirs / ours - 1|
double apart(long theirs, long ours) { return std::abs(static_cast<double>(theirs) / static_cast<double>(ours) - 1); }

TEST(Li2020, IsAsLargeAsOursWhereCompact) {
  const long maps = parameters([](Graph& graph) {
    mgnet(graph, graph.input("image", {1, 3, 64, 64}), mgnet_size("compact"), true);
  });
  const long light = parameters([](Graph& graph) {
    const LightSizes sizes = light_sizes("compact");
    const Shape rays{1, 3, 1, 16};
    const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 64, 64), sizes, true)[0];
    ask_light(graph, picture, sizes, graph.input("points", rays), graph.input("directions", rays),
              graph.input("skip", {1, 1, 1, 16}, Type::Int));
  });
  EXPECT_LT(apart(maps_parameters("compact"), maps), 0.1) << maps_parameters("compact") << " beside " << maps;
  EXPECT_LT(apart(light_parameters("compact"), light), 0.1) << light_parameters("compact") << " beside " << light;
}

TEST(Li2020, RefusesWhatItCannotHalve) {
  Graph graph;
  EXPECT_THROW(li2020_maps({graph, true, ""}, graph.input("image", {1, 3, 31, 64}), li2020_maps_size("compact")),
               Error);
  EXPECT_THROW(li2020_maps_size("lite"), Error);
  EXPECT_THROW(li2020_light_size("tiny"), Error);
}

}  // namespace
}  // namespace clerestory
