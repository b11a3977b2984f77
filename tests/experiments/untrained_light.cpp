#include "tests/experiments/untrained_light.hpp"

#include "experiments/weights/light_text.hpp"
#include "experiments/weights/maps_text.hpp"
#include "experiments/weights/weights.hpp"

namespace clerestory {
namespace {

LightSizes small_sizes(OutOfViewForm form) {
  LightSizes sizes = light_sizes("compact");
  sizes.in_view.trunk = {.blocks = {1, 1, 1, 1}, .channels = {16, 16, 16, 16}, .stages = 3};
  sizes.in_view.width = 32, sizes.in_view.layers = 2;
  sizes.out_of_view.trunk = {.blocks = {1, 1, 1, 1}, .channels = {16, 16, 16, 16}};
  sizes.out_of_view.march.segments = 8;
  sizes.out_of_view.form = form;
  sizes.out_of_view.shells.rows = 8, sizes.out_of_view.shells.columns = 16;
  sizes.out_of_view.shells.channels = {16, 16}, sizes.out_of_view.shells.code = 16;
  return sizes;
}

void write_light_of(const LightSizes& sizes, const std::filesystem::path& folder, const Size& seen) {
  Graph graph;
  const LitPicture picture = lit_pictures(graph, light_inputs(graph, 1, 64, 64), sizes, false)[0];
  const Shape rays{1, 3, 1, 16};
  ask_light(graph, picture, sizes, graph.input("points", rays), graph.input("directions", rays),
            graph.input("skip", {1, 1, 1, 16}, Type::Int));
  States states(Device::open());
  states.initialise(graph, 5);
  std::filesystem::create_directories(folder);
  write_light(folder, states, {}, {"compact", light_text(sizes), seen, "none", light_states(sizes)});
}

}  // namespace

void write_untrained_light(const std::filesystem::path& folder, const Size& seen, OutOfViewForm form) {
  write_light_of(small_sizes(form), folder, seen);
}

void write_untrained_li2020(const std::filesystem::path& folder, const Size& seen) {
  LightSizes light = light_sizes("compact");
  light.li2020 = Li2020LightSize{{16, 16}, {16, 32, 16, 32, 16, 32}, {32, 16, 32, 16, 16, 16}, 3};
  write_light_of(light, folder, seen);
  MgnetSize maps = mgnet_size("li2020");
  maps.encoder = Li2020MapsSize{{16, 32, 16, 32, 16, 32}, {32, 16, 32, 16, 16, 16}};
  Graph graph;
  mgnet(graph, graph.input("image", {1, 3, 64, 64}), maps, false);
  States states(Device::open());
  states.initialise(graph, 6);
  write_weights(folder / "maps.safetensors", states, {}, std::nullopt,
                {"li2020", net_text(maps), seen, "none", maps_states(maps)});
}

}  // namespace clerestory
