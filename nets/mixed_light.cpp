#include "nets/mixed_light.hpp"

#include "host/ops/light/mix_light.hpp"

namespace clerestory {

LightSizes light_sizes(const std::string& preset) {
  return {in_view_size(preset), out_of_view_size(preset), DeltaDepth::Linear};
}

double in_view_flops(const InViewSize& s) {
  const double reading = s.again > 0 ? 2 : 1, width = s.width;
  return 2 * width * (reading * 2 * s.frequencies + (s.layers - 1) * width + 3);
}

double out_of_view_flops(const OutOfViewSize& s) {
  if (s.form == OutOfViewForm::Shells) return 0;
  double in = 3 + 6 * s.octaves, products = 0;
  for (const int out : s.hidden) products += in * out, in = out;
  return 2 * s.march.segments * (products + 4 * in);
}

std::vector<LitPicture> lit_pictures(Graph& graph, const LightInputs& p, const LightSizes& sizes, bool training) {
  const std::vector<LightPixels> pixels =
      light_pixels_of_batch({graph, training, "local"}, p.image, p.surfaces, sizes.in_view);
  const std::vector<LightField> fields = light_fields({graph, training, "global"}, p, sizes.out_of_view);
  std::vector<LitPicture> pictures;
  for (int i = 0; i < p.image.shape().n; ++i) {
    const std::size_t at = static_cast<std::size_t>(i);
    const auto own = [&](Value batch) { return item_of(batch, i); };
    pictures.push_back({own(p.image), ssrt_scene(own(p.depth), own(p.surfaces.normal)), own(p.camera), own(p.range),
                        pixels[at], fields[at]});
  }
  return pictures;
}

LightAnswer ask_light(Graph& graph, const LitPicture& p, const LightSizes& sizes, Value points, Value directions,
                      Value skip) {
  LightAnswer answer;
  answer.hits = ssrt(p.scene, p.camera, p.range, directions, {points, skip}, {.delta = sizes.delta});
  answer.out_of_view = out_of_view_light(p.field, points, directions, p.range, sizes.out_of_view);
  answer.in_view =
      in_view_light({graph, false, "local"}, p.pixels, answer.hits.pixel, directions, p.image, sizes.in_view);
  answer.mixed = mix_light(answer.in_view, answer.out_of_view, answer.hits.u);
  return answer;
}

}  // namespace clerestory
