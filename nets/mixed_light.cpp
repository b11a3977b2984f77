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

namespace {

LitPicture picture_of(const LightInputs& p, int i) {
  const auto own = [&](Value batch) { return item_of(batch, i); };
  return {own(p.image), ssrt_scene(own(p.depth), own(p.surfaces.normal)), own(p.camera), own(p.range), {}, {}, {}};
}

std::vector<LitPicture> pictures_of_li2020(Graph& graph, const LightInputs& p, const Li2020LightSize& size,
                                           bool training) {
  const Gaussians all = li2020_light({graph, training, "local"}, p, size);
  const std::vector<Value> axes = items_of(all.axis), sharpness = items_of(all.sharpness),
                           weights = items_of(all.weight);
  std::vector<LitPicture> pictures;
  for (int i = 0; i < p.image.shape().n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    pictures.push_back(picture_of(p, i));
    LitPicture& picture = pictures.back();
    picture.lobes = {axes[at], sharpness[at], weights[at]};
    if (training) continue;
    const auto own = [&](Value batch) { return item_of(batch, i); };
    picture.lobes =
        li2020_as_bright(picture.lobes, {own(p.image),
                                         own(p.depth),
                                         {own(p.surfaces.albedo), own(p.surfaces.normal), own(p.surfaces.material)},
                                         picture.camera,
                                         picture.range});
  }
  return pictures;
}

LightAnswer ask_li2020(const LitPicture& p, Value points, Value directions, const SsrtHits& hits) {
  const Value cells = point_cells(points, p.camera, p.image.shape(), p.lobes.sharpness.shape());
  const Value light = spherical_gaussians(gather_gaussians(p.lobes, cells), directions);
  return {light, light, light, hits};
}

}  // namespace

std::vector<LitPicture> lit_pictures(Graph& graph, const LightInputs& p, const LightSizes& sizes, bool training) {
  if (sizes.li2020) return pictures_of_li2020(graph, p, *sizes.li2020, training);
  const std::vector<LightPixels> pixels =
      light_pixels_of_batch({graph, training, "local"}, p.image, p.surfaces, sizes.in_view);
  const std::vector<LightField> fields = light_fields({graph, training, "global"}, p, sizes.out_of_view);
  std::vector<LitPicture> pictures;
  for (int i = 0; i < p.image.shape().n; ++i) {
    const std::size_t at = static_cast<std::size_t>(i);
    pictures.push_back(picture_of(p, i));
    pictures.back().pixels = pixels[at], pictures.back().field = fields[at];
  }
  return pictures;
}

LightAnswer ask_light(Graph& graph, const LitPicture& p, const LightSizes& sizes, Value points, Value directions,
                      Value skip) {
  LightAnswer answer;
  answer.hits = ssrt(p.scene, p.camera, p.range, directions, {points, skip}, {.delta = sizes.delta});
  if (sizes.li2020) return ask_li2020(p, points, directions, answer.hits);
  answer.out_of_view = out_of_view_light(p.field, points, directions, p.range, sizes.out_of_view);
  answer.in_view =
      in_view_light({graph, false, "local"}, p.pixels, answer.hits.pixel, directions, p.image, sizes.in_view);
  answer.mixed = mix_light(answer.in_view, answer.out_of_view, answer.hits.u);
  return answer;
}

}  // namespace clerestory
